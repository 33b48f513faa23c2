//! The paper's protocol (Kuznetsov et al. 2022, table 1): materials on curved meshes against displaced truth, from several cameras.

mod flicker;
mod pictures;
mod report;
mod silhouettes;
mod subject;

pub use flicker::{FlickerRow, flicker_rows};
pub use pictures::{PictureOptions, PictureScore, pictures};
pub use report::{mask_strip, page, print, strips};
pub use silhouettes::{SilhouetteRow, silhouettes};
pub use subject::{Cost, Entry, Form, Subject, Truth};
