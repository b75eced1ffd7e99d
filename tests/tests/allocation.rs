//! After construction a frame allocates nothing: counted, not promised.
//!
//! One test only, since the counter sees the whole process.
#![allow(unsafe_code)] // An allocator cannot be written without.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use apgstmd_core::params::{RejectionMode, Support};
use apgstmd_core::tracking::Observation;
use apgstmd_core::{
    Bank, BankParams, Detection, Detector, Frame, Machine, Model, Params, Preset, Rectangle, Region, Size, Stage,
    Tracker,
};
use apgstmd_tests::stimulus::Scene;
use ndarray::Array2;

struct Counting;

static COUNTING: AtomicBool = AtomicBool::new(false);
static ALLOCATIONS: AtomicUsize = AtomicUsize::new(0);

fn count() {
    if COUNTING.load(Ordering::SeqCst) {
        ALLOCATIONS.fetch_add(1, Ordering::SeqCst);
    }
}

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promise.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise.
        unsafe { System.dealloc(pointer, layout) }
    }
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promise.
        unsafe { System.alloc_zeroed(layout) }
    }
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: the caller's promise.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Allocations on any thread while `action` runs.
fn allocations(action: impl FnOnce()) -> usize {
    ALLOCATIONS.store(0, Ordering::SeqCst);
    COUNTING.store(true, Ordering::SeqCst);
    action();
    COUNTING.store(false, Ordering::SeqCst);
    ALLOCATIONS.load(Ordering::SeqCst)
}

const SIZE: Size = Size::new(40, 60);

fn none_in_300_frames(name: &str, params: &Params, region: Option<&Region>, threads: usize) {
    let scene = Scene::lively(SIZE, 1.0, 8);
    // Forwards and backwards: the targets never leave.
    let frames: Vec<Array2<u8>> = (0..50).map(|t| scene.frame(t)).collect();
    let there_and_back = |t: usize| &frames[if (t / 50).is_multiple_of(2) { t % 50 } else { 49 - t % 50 }];
    let mut detector = Detector::with_threads(scene.size, params, threads).expect("valid parameters");
    detector.look_in(region).expect("of the same size");
    let mut response = detector.make_response();
    let (mut attended, mut found) = (0, 0);
    for t in 0..300 {
        let count =
            allocations(|| detector.process_into(there_and_back(t).view(), &mut response).expect("a valid frame"));
        assert_eq!(count, 0, "{name}, {threads} threads: allocations in frame {t}");
        found += response.detections.len();
        // A copy of a stage allocates: looked at now and then, outside the count. Where there is no attention, none can
        // be missed.
        if t % 10 == 9 {
            attended += usize::from(detector.probe().stage(Stage::A).map_or(true, |a| a.iter().any(|a| *a != 0.0)));
        }
    }
    assert!(attended >= 20 && found >= 100, "{name}: attention {attended} times of 30, {found} detections");
    let machine = Machine { together: 3, ..Machine::with_threads(threads) };
    let mut detector = Detector::with_options(scene.size, params, &machine).expect("valid parameters");
    detector.look_in(region).expect("of the same size");
    let mut responses: Vec<_> = (0..7).map(|_| detector.make_response()).collect();
    for frames in frames.chunks_exact(7) {
        let frames: Vec<Frame<'_>> = frames.iter().map(|frame| frame.view().into()).collect();
        let count = allocations(|| detector.process_block(&frames, &mut responses).expect("valid frames"));
        assert_eq!(count, 0, "{name}, {threads} threads: allocations in a block");
    }
    let again = allocations(|| {
        detector.reset();
        detector.process_into(frames[0].view(), &mut response).expect("a valid frame");
    });
    assert_eq!(again, 0, "{name}: reset");
}

fn a_bank_in_200_frames(threads: usize) {
    let scene = Scene::lively(Size::new(64, 96), 1.0, 8);
    let frames: Vec<Array2<u8>> = (0..50).map(|t| scene.frame(t)).collect();
    let machine = Machine::with_threads(threads);
    let mut bank = Bank::with_options(scene.size, &BankParams::default(), &machine).expect("valid parameters");
    let mut response = bank.make_response();
    let mut found = 0;
    for t in 0..200 {
        let frame = frames[if (t / 50) % 2 == 0 { t % 50 } else { 49 - t % 50 }].view();
        let count = allocations(|| bank.process_into(frame, &mut response).expect("a valid frame"));
        assert_eq!(count, 0, "bank, {threads} threads: allocations in frame {t}");
        found += response.detections.len();
    }
    assert!(found >= 100, "{found} detections");
    let again = allocations(|| {
        bank.reset();
        bank.process_into(frames[0].view(), &mut response).expect("a valid frame");
    });
    assert_eq!(again, 0, "bank: reset");
}

/// Targets that come and go, apart from each other: once there were as many tracks as there ever are.
fn tracks_that_do_not_compete() {
    let mut tracker = Tracker::new(Size::new(100, 400), &Params::default()).expect("valid parameters");
    let mut points = Vec::new();
    let mut reported = 0;
    for t in 0..600 {
        let shown = |i: &usize| !(t / 7 + i).is_multiple_of(5) && (t + 40 * i) % 150 < 110;
        let target = |i: usize| Detection {
            x: 20.0 + 60.0 * i as f32 + 0.25 * ((t + 40 * i) % 150) as f32,
            y: 50.0,
            score: 1.0,
            trace: i as u64,
            ..Detection::default()
        };
        let mut seen = [target(0); 6];
        let mut count = 0;
        for i in (0..6).filter(shown) {
            seen[count] = target(i);
            count += 1;
        }
        let made = allocations(|| tracker.process_into(&Observation::new(t, &seen[..count]), &mut points));
        assert!(t < 300 || made == 0, "tracker: {made} allocations in frame {t}");
        reported += points.len();
    }
    assert!(reported > 1000, "{reported} points");
}

#[test]
fn a_frame_allocates_nothing() {
    tracks_that_do_not_compete();
    assert!(allocations(|| drop(std::hint::black_box(Box::new(1)))) == 1, "the counter must count");
    for threads in [1, 2] {
        a_bank_in_200_frames(threads);
        let practical = Params::preset(Preset::Practical).for_speed(1.0).expect("a valid speed");
        none_in_300_frames("practical", &practical, None, threads);
        let middle = Rectangle { x: 9, y: 7, width: 42, height: 26 };
        let middle = Region::from_rectangles(SIZE, &[middle]).expect("not empty");
        none_in_300_frames("a region", &practical, Some(&middle), threads);
        let mut masked = Params::default().for_speed(1.0).expect("a valid speed");
        masked.attention.support = Support::Masked;
        masked.rejection.mode = RejectionMode::Off;
        none_in_300_frames("masked", &masked, None, threads);
        let mut contrast = Params::default().for_speed(1.0).expect("a valid speed");
        contrast.rejection.contrast_deviation = 0.01;
        none_in_300_frames("contrast", &contrast, None, threads);
        for &model in &Model::ALL[1..] {
            let mut params = Params::for_model(model).for_speed(1.0).expect("a valid speed");
            none_in_300_frames(model.name(), &params, None, threads);
            params.rejection.mode = RejectionMode::Motion;
            none_in_300_frames(model.name(), &params, None, threads);
        }
    }
}
