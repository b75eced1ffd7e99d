//! One page with the table and both curves: no script, no network, light or dark as the reader's screen is.

use minijinja::{AutoEscape, Environment, context};

use super::{Report, degrees, figure, pixels, score};

const TEMPLATE: &str = include_str!("page.html");

/// The page as HTML.
pub fn page(report: &Report) -> String {
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    let rows: Vec<_> = report
        .operating_points()
        .into_iter()
        .map(|row| {
            let (operating, point) = (row.point, row.point.point.as_ref());
            context! {
                name => row.name,
                limited => operating.limit.is_some(),
                alarms => point.map(|p| format!("{:.3}", p.false_alarms)),
                rate => format!("{:.3}", operating.detection_rate),
                precision => point.map(|p| format!("{:.3}", p.precision)),
                threshold => point.map(|p| score(p.threshold)),
                position => pixels(operating.localisation_error),
                direction => degrees(operating.direction_error),
            }
        })
        .collect();
    let values = context! {
        detections => report.detections.display().to_string(),
        truth => report.truth.display().to_string(),
        version => env!("CARGO_PKG_VERSION"),
        facts => report.facts(),
        tracks => report.track_facts(),
        rows,
        notes => report.notes(),
        radius => report.radius.to_string(),
        margin => report.margin.to_string(),
        roc => figure::roc(report.evaluation()),
        precision_recall => figure::precision_recall(report.evaluation()),
    };
    environment.render_str(TEMPLATE, values).expect("the template is ours and a test renders it")
}
