//! One page: each figure beside what the paper says, the number measured and its rule. No script, no network, light or
//! dark as the reader's screen is.

use minijinja::{AutoEscape, Environment, context};

use super::Extent;
use super::summary::Run;

const TEMPLATE: &str = include_str!("page.html");

/// The page as HTML.
pub fn page(run: &Run) -> String {
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    let experiments: Vec<_> = run
        .written
        .iter()
        .map(|written| {
            let experiment = written.experiment();
            let checks: Vec<_> = written
                .checks()
                .iter()
                .map(|check| {
                    context! {
                        what => &check.what,
                        measured => check.measured(),
                        wanted => check.wanted(),
                        verdict => check.verdict(),
                    }
                })
                .collect();
            let files = &written.files;
            context! {
                name => experiment.name,
                title => experiment.title,
                paper => experiment.paper,
                method => experiment.method,
                caption => experiment.caption,
                holds => written.holds(),
                svg => &written.svg,
                // One panel beside another needs the page's width.
                wide => written.done.findings.figure.columns > 1,
                checks,
                files,
            }
        })
        .collect();
    let values = context! {
        version => env!("CARGO_PKG_VERSION"),
        quick => run.extent == Extent::Quick,
        interrupted => run.interrupted,
        verdict => run.verdict(),
        holds => run.failing().is_empty(),
        experiments,
    };
    environment.render_str(TEMPLATE, values).expect("the template is ours and a test renders it")
}
