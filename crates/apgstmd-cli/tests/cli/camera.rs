//! camera.csv and the page's lane: how the camera moved, frame by frame.

use std::fs;

use crate::common::{apgstmd, csv_rows, page_data, results};

#[test]
fn a_pan_is_told_frame_by_frame() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("pan.toml");
    let text = "width = 160\nheight = 120\nrate = 100.0\nframes = 50\nseed = 3\n\
        [background]\nkind = 'natural'\nvelocity = [-30.0, 10.0]\n\
        [[target]]\npath = { kind = 'straight', start = [20.0, 60.0], speed = 100.0 }\n";
    fs::write(&scene, text).unwrap();
    for engine in ["--speed 1", "--speeds 1 --sizes 5"] {
        let (_parent, out) = results();
        apgstmd(&format!("run {{in}} --out {{out}} {engine} --report {{out}}.html"), &scene, &out).ok();
        let table = fs::read_to_string(out.join("camera.csv")).unwrap();
        let mut lines = table.lines();
        let columns = "frame,time_s,detections,background_x,background_y,rotation_rad,zoom,residual,unexplained,cut";
        assert_eq!(lines.next(), Some(columns));
        let rows: Vec<Vec<f64>> =
            lines.map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect()).collect();
        assert_eq!(rows.len(), 50);
        let found = csv_rows(&out.join("detections.csv"));
        for (frame, row) in rows.iter().enumerate() {
            let [number, time, detections, x, y, rotation, zoom, residual, unexplained, cut] = row[..] else {
                panic!("{row:?}")
            };
            assert_eq!((number, time), (frame as f64, frame as f64 / 100.0));
            assert_eq!(detections as usize, found.iter().filter(|row| row.frame == frame).count());
            // -0.3 and 0.1 px a frame; before the first there is nothing to compare with.
            let (wanted_x, wanted_y) = if frame == 0 { (0.0, 0.0) } else { (-0.3, 0.1) };
            assert!((x - wanted_x).abs() < 0.03 && (y - wanted_y).abs() < 0.03, "{engine}, frame {frame}: {x}, {y}");
            assert!(rotation.abs() < 1e-3 && (zoom - 1.0).abs() < 1e-3 && (0.0..0.05).contains(&residual), "{row:?}");
            assert_eq!((unexplained, cut), (0.0, 0.0));
        }
        let (text, data) = page_data(&out.with_extension("html"));
        assert!(text.contains("<canvas id=\"camera\"") && !text.contains("id=\"still\""));
        // Rounded to what the page shows.
        let columns = &data["frames"]["camera"];
        for (name, column, unit) in [("x", 3, 0.01), ("y", 4, 0.01), ("zoom", 6, 1e-5), ("residual", 7, 1e-4)] {
            let shown = columns[name].as_array().unwrap();
            assert_eq!(shown.len(), 50);
            for (shown, row) in shown.iter().zip(&rows) {
                assert!((shown.as_f64().unwrap() - row[column]).abs() < 0.51 * unit, "{name}: {shown}, {row:?}");
            }
        }
        let shifts = data["bins"]["camera"]["shift"].as_array().unwrap();
        assert!(shifts.len() == 50 && (shifts[20].as_f64().unwrap() - 0.1f64.sqrt()).abs() < 0.03, "{shifts:?}");
    }
}

/// Where nothing moved, or nothing was looked for, the page says so.
#[test]
fn a_page_says_why_there_is_no_lane() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("still.toml");
    let text = "width = 96\nheight = 64\nrate = 100.0\nframes = 12\nseed = 3\n[background]\nkind = 'natural'\n";
    fs::write(&scene, text).unwrap();
    for (flags, why) in [
        ("--rejection motion", "Camera: it did not move, by less than 0.05 px from frame to frame."),
        ("--rejection off", "Camera: not followed, which takes the rejection &quot;motion&quot;"),
    ] {
        let (_parent, out) = results();
        apgstmd(&format!("run {{in}} --out {{out}} --speed 1 {flags} --report {{out}}.html"), &scene, &out).ok();
        let (text, data) = page_data(&out.with_extension("html"));
        assert!(text.contains(why) && !text.contains("<canvas id=\"camera\""), "{flags}");
        assert!(data["frames"]["camera"].is_null() && data["bins"]["camera"].is_null());
    }
}
