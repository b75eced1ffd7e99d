//! The two curves as SVG.

use apgstmd_core::evaluation::{Evaluation, Point};
use plotters::prelude::*;

use super::chart::{CURVE, INK, MARK, draw, frame, mesh};

/// Steps shorter than this part of an axis are not seen.
const UNSEEN: f64 = 1e-3;
/// False alarms a frame between which the area is taken.
const AREA: f64 = 1.0;

/// Detection rate over false alarms a frame.
pub(super) fn roc(e: &Evaluation) -> String {
    let most = e.curve.last().map_or(0.0, |point| point.false_alarms);
    let (low, high) = (least_alarms(e.frames), 10f64.powf(most.max(10.0).log10().ceil()));
    let curve = steps(&e.curve, low);
    let shaded: Vec<_> = cut(&curve, AREA);
    draw(|area| {
        let mut chart = frame(area).build_cartesian_2d((0.98 * low..high).log_scale(), 0.0..1.0)?;
        mesh(&mut chart, ("false alarms a frame", &|x| format!("{x}")), ("detection rate", &tenths))?;
        chart.draw_series(AreaSeries::new(shaded.iter().copied(), 0.0, CURVE.mix(0.18)))?;
        chart.draw_series(LineSeries::new([(AREA, 0.0), (AREA, 1.0)], INK.mix(0.6)))?;
        // Beyond the last threshold there is nothing more to find: the rate stays.
        if let Some(&(x, y)) = curve.last().filter(|last| last.0 < high) {
            chart.draw_series(DashedLineSeries::new([(x, y), (high, y)], 4, 4, CURVE.into()))?;
        }
        chart.draw_series(LineSeries::new(curve, CURVE.stroke_width(2)))?;
        let dots = e.at.iter().filter_map(|at| Some((at.limit?, at.point?.detection_rate)));
        chart.draw_series(dots.map(|at| Circle::new(at, 4, MARK.filled())))?;
        Ok(())
    })
}

/// Precision over recall.
pub(super) fn precision_recall(e: &Evaluation) -> String {
    let points = thinned(e.curve.iter().map(|p| (p.detection_rate, p.precision)));
    draw(|area| {
        let mut chart = frame(area).build_cartesian_2d(0.0..1.0, 0.0..1.0)?;
        mesh(&mut chart, ("recall (detection rate)", &tenths), ("precision", &tenths))?;
        chart.draw_series(LineSeries::new(points, CURVE.stroke_width(2)))?;
        let best = e.best_f1.point.map(|p| (p.detection_rate, p.precision));
        chart.draw_series(best.map(|at| Circle::new(at, 4, MARK.filled())))?;
        Ok(())
    })
}

fn tenths(value: &f64) -> String {
    format!("{value:.1}")
}

/// Left end of the axis: fewer false alarms than one in all frames there are not.
fn least_alarms(frames: usize) -> f64 {
    10f64.powf((1.0 / frames as f64).log10().floor()).clamp(1e-4, 1e-2)
}

/// The step curve: at each place the rate of the lowest threshold that keeps to so many false alarms.
fn steps(curve: &[Point], low: f64) -> Vec<(f64, f64)> {
    let Some(first) = curve.first() else { return Vec::new() };
    let mut corners = vec![(low.max(first.false_alarms), 0.0)];
    for point in curve {
        let x = point.false_alarms.max(low);
        let before = corners[corners.len() - 1].1;
        corners.extend([(x, before), (x, point.detection_rate)]);
    }
    // On a logarithmic axis distances are ratios.
    let kept = thinned(corners.into_iter().map(|(x, y)| (x.log10() / 4.0, y)));
    kept.into_iter().map(|(x, y)| (10f64.powf(4.0 * x), y)).collect()
}

/// Drops points that lie on the last one kept, as far as anybody can see.
fn thinned(points: impl Iterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    let mut kept: Vec<(f64, f64)> = Vec::new();
    let mut last = None;
    for (x, y) in points {
        if kept.last().is_none_or(|k| (k.0 - x).abs() > UNSEEN || (k.1 - y).abs() > UNSEEN) {
            kept.push((x, y));
        }
        last = Some((x, y));
    }
    kept.extend(last.filter(|last| kept.last() != Some(last)));
    kept
}

/// The part of a step curve up to `x`.
fn cut(curve: &[(f64, f64)], x: f64) -> Vec<(f64, f64)> {
    let mut part: Vec<_> = curve.iter().copied().take_while(|point| point.0 <= x).collect();
    part.extend(part.last().map(|last| (x, last.1)));
    part
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(false_alarms: f64, detection_rate: f64) -> Point {
        Point {
            false_alarms,
            detection_rate,
            threshold: 0.0,
            true_detections: 0,
            false_detections: 0,
            precision: 0.0,
            f1: 0.0,
        }
    }

    #[test]
    fn steps_go_right_then_up() {
        let corners = steps(&[point(0.0, 0.25), point(0.1, 0.25), point(0.1, 0.75)], 0.01);
        let expected = [(0.01, 0.0), (0.01, 0.25), (0.1, 0.25), (0.1, 0.75)];
        assert_eq!(corners.len(), expected.len());
        for (a, b) in corners.iter().zip(expected) {
            assert!((a.0 - b.0).abs() < 1e-9 && a.1 == b.1, "{corners:?}");
        }
        assert_eq!(cut(&expected, 0.05), [(0.01, 0.0), (0.01, 0.25), (0.05, 0.25)]);
        assert!(steps(&[], 0.01).is_empty() && cut(&[], 1.0).is_empty());
    }

    #[test]
    fn a_million_points_make_a_small_figure() {
        let many = thinned((0..1_000_000).map(|i| (i as f64 * 1e-6, i as f64 * 1e-6)));
        assert!(many.len() < 1100 && many.last() == Some(&(0.999_999, 0.999_999)), "{}", many.len());
    }

    #[test]
    fn axes_begin_below_what_can_be() {
        for (frames, expected) in [(10, 1e-2), (150, 1e-3), (1000, 1e-3), (1 << 30, 1e-4)] {
            assert!((least_alarms(frames) / expected - 1.0).abs() < 1e-9, "{frames}");
        }
    }
}
