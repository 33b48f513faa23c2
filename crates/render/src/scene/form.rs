//! [`MaterialForm`]: the word in a scene that says what stands for a microstructure.

use serde::{Deserialize, Serialize};

/// What stands for a microstructure in a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MaterialForm {
    /// A trained model under the mesh as a bounding surface.
    Neural,
    /// An exact tracer in the model's place: what is left of the error is that of the query.
    Oracle,
    /// Real triangles: the truth.
    Displaced,
    /// A height field marched in the local frame of each query, with direct light only.
    March,
    /// A model without curvature and silhouettes on the opaque mesh.
    Neumip,
    /// The mesh as it is, with the microstructure's normals and colours.
    Flat,
}

impl MaterialForm {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::Neural, Self::Oracle, Self::Displaced, Self::March, Self::Neumip, Self::Flat];

    /// The word for it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Neural => "neural",
            Self::Oracle => "oracle",
            Self::Displaced => "displaced",
            Self::March => "march",
            Self::Neumip => "neumip",
            Self::Flat => "flat",
        }
    }
}
