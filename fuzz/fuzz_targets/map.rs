//! Maps: PNG, JPEG and EXR.
#![no_main]

use libfuzzer_sys::fuzz_target;
use osculate_sbtf::micro::import::Raster;

fuzz_target!(|data: &[u8]| {
    let Ok(raster) = Raster::decode(data) else { return };
    let texels = raster.width * raster.height;
    assert!(matches!(raster.planes.len(), 1 | 3) && raster.planes.iter().all(|p| p.len() == texels));
    let _ = raster.into_grey();
});
