//! Every kind of panel, with made-up data: both files of it, of one size.

use super::*;

fn panels() -> Vec<Panel> {
    let wave = Array2::from_shape_fn((9, 12), |(y, x)| (x as f64 / 3.0).sin() * (y as f64 / 4.0).cos() * 1e-4);
    let grid = |label: &str| Grid { label: label.into(), first: 0.0, step: 1.0 };
    let names = ["apg-STMD", "STMD+", "DSTMD", "Cascaded", "ESTMD"];
    let rates =
        |i: usize| (0..40).map(|k| 0.9 / (1 + i) as f64 * (1.0 - (-(k as f64) / 9.0).exp())).collect::<Vec<f64>>();
    let curve = |i: usize| (0..40).map(|k| 2e-3 * 1.25f64.powi(k)).zip(rates(i)).collect::<Vec<(f64, f64)>>();
    let measured = |i: usize| {
        [0.05, 0.1, 0.2, 0.4, 0.6].map(|at| {
            let value = (at * (1.6 - 0.2 * i as f64)).min(0.97);
            Measured { at, value, interval: (value - 0.04, value + 0.03) }
        })
    };
    let map = Map {
        values: wave.clone(),
        x: grid("x, px"),
        y: grid("y, px"),
        label: "value".into(),
        colors: Colors::Viridis,
        range: None,
        marks: vec![(3.0, 4.0, "A & <B>".into())],
        lines: vec![vec![(0.0, 0.0), (11.0, 8.0)]],
    };
    vec![
        Panel::new(
            "(a) curves over all thresholds",
            roc(names.iter().enumerate().map(|(i, n)| ((*n).into(), curve(i)))),
        ),
        Panel::new(
            "(b) area over contrast",
            comparison(
                "Weber contrast",
                "area",
                names.iter().enumerate().map(|(i, n)| ((*n).into(), measured(i).to_vec())).collect(),
            ),
        ),
        Panel { wide: true, ..Panel::new("(c) plane", Plot::Map(map.clone())) },
        Panel::new("(d) frame", Plot::Map(Map { colors: Colors::Grey, label: String::new(), ..map })),
        Panel::new("(e) relief", Plot::Relief(Relief { values: wave, reach: 5.0, label: "value".into() })),
        Panel::new(
            "(f) directions",
            Plot::Polar(Polar {
                series: vec![("E".into(), [1.0, 0.5, 0.2, 0.0, 0.0, 0.0, 0.2, 0.5])],
                full: None,
                arrow: Some(0.0),
            }),
        ),
        Panel::new("(g) nothing", Plot::Curves(Curves::default())),
    ]
}

#[test]
fn every_kind_in_both_files() {
    let figure = Figure { columns: 2, panels: panels() };
    assert_eq!(figure.rows().iter().map(|row| row.len()).collect::<Vec<_>>(), [2, 1, 2, 2]);
    let Drawing { svg, png } = draw(&figure);
    let picture = image::load_from_memory(&png).unwrap();
    assert!(svg.contains(&format!("viewBox=\"0 0 {} {}\"", picture.width(), picture.height())), "{}", &svg[..200]);
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
    // Two maps and a colour bar.
    assert_eq!(svg.matches("<image ").count(), 3);
    for text in ["apg-STMD", "false alarms a frame", "Weber contrast", "A &amp; &lt;B&gt;", "10⁻⁵", "315°"] {
        assert!(svg.contains(text), "{text}");
    }
    for odd in ["NaN", "inf", "<script", "http://www.w3.org/1999"] {
        assert!(!svg.contains(odd), "{odd}");
    }
    // Not blank: ink, ground, and the colours of the map.
    let rgb = picture.to_rgb8();
    let dark = rgb.pixels().filter(|pixel| pixel.0.iter().all(|v| *v < 0x60)).count();
    let white = rgb.pixels().filter(|pixel| pixel.0 == [255; 3]).count();
    assert!(dark > 5_000 && white > 1_000_000, "{dark} {white}");
}

#[test]
fn an_empty_figure_is_drawn() {
    let Drawing { svg, png } = draw(&Figure::default());
    assert!(svg.contains("</svg>") && image::load_from_memory(&png).is_ok());
}
