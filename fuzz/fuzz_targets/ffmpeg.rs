#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| apgstmd_tests::boundary::check("ffmpeg", bytes));
