#![no_main]

use fam_io::Format;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    fam_fuzz::check(Format::Stl, bytes);
});
