//! The paper's protocol (Kuznetsov et al. 2022, table 1): materials on curved meshes against displaced truth, from several cameras.

mod figures;
mod flicker;
mod pictures;
mod report;
mod silhouettes;
mod subject;

pub use figures::{Captioned, Exhibit, exhibit, mask_strip, overview, sheets};
pub use flicker::{FlickerOptions, FlickerRow, flicker_rows};
pub use pictures::{PictureOptions, PictureScore, pictures};
pub use report::{page, print};
pub use silhouettes::{SilhouetteRow, silhouettes};
pub use subject::{Cost, Entry, Form, Subject, Truth};
