//! Every entrant on every scene.

use apgstmd_core::evaluation::{Evaluation, Options, Scored, TruthBox, evaluate};
use apgstmd_core::stimulus::Renderer;
use apgstmd_core::{Detector, Size};
use ndarray::Array2;
use rayon::prelude::*;

use super::entrants::Entrant;
use super::panorama::panorama;
use super::scenes::{Clutter, SETTLING, Setting};
use crate::Outcome;
use crate::failure::Failure;
use crate::interrupt;
use crate::reproduce::Bench;

/// How an entrant did on a scene.
pub struct Score {
    pub setting: Setting,
    /// Place in the list of entrants.
    pub entrant: usize,
    pub evaluation: Evaluation,
}

/// Scores, scene by scene, entrants in their order.
pub fn run(bench: &Bench, settings: &[Setting], entrants: &[Entrant]) -> Outcome<Vec<Score>> {
    bench.announce(settings.iter().map(|setting| setting.scene().frames).sum());
    let scores: Vec<Outcome<Vec<Score>>> =
        settings.par_iter().map(|setting| on_scene(bench, setting, entrants)).collect();
    let mut all = Vec::new();
    for scores in scores {
        all.extend(scores?);
    }
    Ok(all)
}

fn on_scene(bench: &Bench, setting: &Setting, entrants: &[Entrant]) -> Outcome<Vec<Score>> {
    let scene = setting.scene();
    let renderer = match setting.clutter {
        Clutter::Natural => Renderer::new(&scene),
        Clutter::Panorama => Renderer::with_panorama(&scene, panorama(setting.seed).view()),
    }
    .map_err(Failure::failed)?;
    let size = Size::new(scene.height, scene.width);
    let mut running = entrants
        .iter()
        .map(|entrant| {
            let detector = Detector::with_threads(size, &entrant.params, 1).map_err(Failure::failed)?;
            let response = detector.make_response();
            Ok((detector, response, Vec::new()))
        })
        .collect::<Outcome<Vec<_>>>()?;
    let mut truth: Vec<TruthBox> = Vec::new();
    for t in 0..scene.frames {
        if interrupt::asked() {
            return Err(Failure::Interrupted);
        }
        // As a camera of 8 bits gives it.
        let frame: Array2<u8> = renderer.frame(t).mapv(|luminance| (255.0 * luminance).round() as u8);
        truth.extend(renderer.truth(t).into_iter().map(TruthBox::from));
        for (detector, response, found) in &mut running {
            detector.process_into(frame.view(), response).map_err(Failure::failed)?;
            found.extend(response.detections.iter().map(|d| Scored::new(t, d.x.into(), d.y.into(), d.score.into())));
        }
        bench.tick();
    }
    let options = Options::new(SETTLING..scene.frames);
    running
        .into_iter()
        .enumerate()
        .map(|(entrant, (_, _, found))| {
            let evaluation = evaluate(&found, &truth, &options).map_err(Failure::failed)?;
            Ok(Score { setting: *setting, entrant, evaluation })
        })
        .collect()
}
