//! Models beside each other: curves over false alarms, and a measure with its confidence.

use super::{Axis, Curves, Look, Plot, Series};

/// A measure of a model at one place: where, how much, and its confidence interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// On the horizontal axis.
    pub at: f64,
    /// How much.
    pub value: f64,
    /// Lower and upper end.
    pub interval: (f64, f64),
}

/// Detection rate over false alarms a frame, a curve for each name. The points of a curve are (false alarms, rate) in
/// rising order; between them the rate of the last one holds, as it does for a threshold.
pub fn roc(curves: impl IntoIterator<Item = (String, Vec<(f64, f64)>)>) -> Plot {
    let series = curves.into_iter().map(|(name, points)| Series {
        name,
        points: corners(&points),
        look: Look::Line,
        ..Series::default()
    });
    Plot::Curves(Curves {
        x: Axis { label: "false alarms a frame".into(), range: Some((1e-3, 10.0)), logarithmic: true },
        y: Axis { label: "detection rate".into(), range: Some((0.0, 1.0)), ..Axis::default() },
        series: series.collect(),
        ..Curves::default()
    })
}

/// A measure from 0 to 1 over something, a curve for each name. Intervals of different curves stand beside each other.
pub fn comparison(x: &str, y: &str, curves: Vec<(String, Vec<Measured>)>) -> Plot {
    let places = || curves.iter().flat_map(|(_, measured)| measured.iter().map(|m| m.at));
    let (least, most) = (places().fold(f64::INFINITY, f64::min), places().fold(f64::NEG_INFINITY, f64::max));
    let span = most - least;
    let range = (span > 0.0).then_some((least - 0.05 * span, most + 0.05 * span));
    let count = curves.len() as f64;
    let series = curves.into_iter().enumerate().map(|(i, (name, measured))| {
        let aside = 0.008 * span * (i as f64 - (count - 1.0) / 2.0);
        Series {
            name,
            points: measured.iter().map(|m| (m.at + aside, m.value)).collect(),
            bars: measured.iter().map(|m| m.interval).collect(),
            ..Series::default()
        }
    });
    Plot::Curves(Curves {
        x: Axis { label: x.to_owned(), range, ..Axis::default() },
        y: Axis { label: y.to_owned(), range: Some((0.0, 1.0)), ..Axis::default() },
        series: series.collect(),
        ..Curves::default()
    })
}

/// To the right, then up; the last rate goes on to the end of the axis.
fn corners(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut corners = Vec::new();
    let mut rate = 0.0;
    for &(x, y) in points {
        corners.extend([(x, rate), (x, y)]);
        rate = y;
    }
    corners.extend((!points.is_empty()).then_some((f64::INFINITY, rate)));
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_hold_until_the_next_point() {
        let expected = [(0.0, 0.0), (0.0, 0.2), (0.5, 0.2), (0.5, 0.9), (f64::INFINITY, 0.9)];
        assert_eq!(corners(&[(0.0, 0.2), (0.5, 0.9)]), expected);
        assert!(corners(&[]).is_empty());
    }

    #[test]
    fn intervals_stand_beside_each_other() {
        let at = |at| Measured { at, value: 0.5, interval: (0.4, 0.6) };
        let models = ["a", "b", "c"].map(|name| (name.to_owned(), vec![at(0.0), at(1.0)]));
        let Plot::Curves(curves) = comparison("contrast", "area", models.to_vec()) else { panic!("curves") };
        let places: Vec<f64> = curves.series.iter().map(|series| series.points[0].0).collect();
        assert_eq!(places, [-0.008, 0.0, 0.008]);
    }
}
