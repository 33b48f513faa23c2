//! Recorded references.
#![no_main]

use libfuzzer_sys::fuzz_target;
use osculate_geom::reference::ReferenceFile;

fuzz_target!(|data: &[u8]| {
    if let Ok(file) = ReferenceFile::from_bytes(data) {
        for setting in file.settings.values() {
            assert_eq!(setting.kappa_max.len(), file.positions.len());
        }
    }
});
