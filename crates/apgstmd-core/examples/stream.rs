//! A stream, frame by frame, without a single allocation once the detector is made: detections, then tracks.
//!
//!     cargo run --release --package apgstmd-core --example stream

use std::error::Error;

use apgstmd_core::stimulus::{Renderer, Scene};
use apgstmd_core::tracking::Observation;
use apgstmd_core::{Detector, Params, Preset, Size, Tracker};

fn main() -> Result<(), Box<dyn Error>> {
    // What stands in for a camera: three dark targets and a light one before a background that moves.
    let scene = Scene::demo();
    let renderer = Renderer::new(&scene)?;
    let size = Size::new(scene.height, scene.width);

    // Targets of about 1 px from frame to frame; this is the first thing to set for another camera.
    let params = Params::preset(Preset::Practical).for_speed(1.0)?;
    let mut detector = Detector::new(size, &params)?;
    let mut tracker = Tracker::new(size, &params)?;

    // Made once, used for every frame.
    let (mut frame, mut response, mut points) = (renderer.make_frame(), detector.make_response(), Vec::new());
    let mut longest = 0;
    for t in 0..90 {
        renderer.frame_into(t, &mut frame);
        detector.process_into(frame.view(), &mut response)?;
        tracker.process_into(&Observation::of(t, &response, detector.lag()), &mut points);
        // Points of tracks that are certain now: those of this frame, and those that were held back until then.
        longest = points.iter().map(|point| point.age).fold(longest, u32::max);
        if let Some(best) = response.detections.first().filter(|_| t % 30 == 29) {
            println!(
                "frame {t:3}: {} detections, strongest at ({:.1}, {:.1}), score {:.3e}, heading {:.0} degrees",
                response.detections.len(),
                best.x,
                best.y,
                best.score,
                best.direction.to_degrees()
            );
        }
    }
    println!("the longest track was followed over {longest} frames");
    assert!(longest > 60, "a dark target of this scene is followed over most of these frames");
    Ok(())
}

#[test]
fn runs() {
    main().unwrap();
}
