//! [`Spec`]: the keys of a material's `.toml`.

use serde::{Deserialize, Serialize};

use super::Problem;

/// Most texels along a side that a procedural material is made with.
const MAX_RESOLUTION: usize = 4096;

/// A material's `.toml`, with file names as they stand in it. Exactly one of `builtin`, `height` and `mesh` is given.
#[derive(Debug, Clone, PartialEq, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Spec {
    /// Name for reports; the file's own, unless given.
    pub name: Option<String>,
    /// A procedural material.
    pub builtin: Option<String>,
    /// Texels along each side of a procedural height field (512).
    pub resolution: Option<usize>,
    /// Depth that the heights span, in UV units.
    pub depth: Option<f32>,
    /// Height map.
    pub height: Option<String>,
    /// Values of the height map that mean the bottom and the bounding surface; the map's least and greatest, unless given.
    pub height_range: Option<[f32; 2]>,
    /// Whether black is high instead of white.
    #[serde(default)]
    pub invert: bool,
    /// What becomes of a height map that does not tile.
    #[serde(default)]
    pub tiling: Tiling,
    /// Map or linear RGB (0.5 grey).
    pub albedo: Option<MapOrValue<[f32; 3]>>,
    /// How the albedo map's 8- and 16-bit codes are meant.
    #[serde(default)]
    pub albedo_encoding: Encoding,
    /// Map or value in `[0, 1]`.
    pub roughness: Option<MapOrValue<f32>>,
    /// Map or value in `[0, 1]` (0).
    pub metalness: Option<MapOrValue<f32>>,
    /// Normal map in the tangent frame of the surface that the heights make.
    pub normal: Option<String>,
    /// Which way green points in it.
    #[serde(default)]
    pub normal_y: NormalY,
    /// Mesh of one tile, any format that Osculate reads.
    pub mesh: Option<String>,
    /// Lengths in the mesh's file that make one tile along u and v; depth follows the first.
    pub period: Option<[f32; 2]>,
    /// The mesh's axis that points out of the surface.
    pub up: Option<Up>,
}

/// A file or one value for all.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(untagged, expecting = "a file name in quotes, a number, or [red, green, blue] for colours")]
pub enum MapOrValue<T> {
    /// An image file.
    Map(String),
    /// The same everywhere.
    Value(T),
}

/// A linear RGB colour.
pub type Colour = [f32; 3];

/// What becomes of a height map that does not tile.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Tiling {
    /// It is an error.
    #[default]
    Require,
    /// All maps are mirrored along u and v: twice the texels each way, half as large in the tile.
    Mirror,
    /// The seam stays, with a warning.
    Accept,
}

/// How codes of a colour map are meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Encoding {
    /// The sRGB curve; the habit of PNG and JPEG.
    #[default]
    Srgb,
    /// Proportional to light. EXR always is.
    Linear,
}

/// Which way green points in a normal map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum NormalY {
    /// Up the picture, as OpenGL has it.
    #[default]
    Up,
    /// Down the picture, as DirectX has it.
    Down,
}

/// The axis of a mesh file that points out of the surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Up {
    /// u is x, v is -z.
    Y,
    /// u is x, v is y.
    Z,
}

impl Spec {
    /// Reads and checks the keys. Files are not looked at.
    ///
    /// # Errors
    ///
    /// No TOML, unknown keys, values out of range, keys that do not go together or are missing.
    pub fn parse(text: &str) -> Result<Self, Problem> {
        let spec: Self = toml::from_str(text).map_err(|e| Problem::Syntax(Box::new(e)))?;
        spec.check()?;
        Ok(spec)
    }

    fn check(&self) -> Result<(), Problem> {
        let kinds = [self.builtin.is_some(), self.height.is_some(), self.mesh.is_some()];
        match kinds.iter().filter(|&&given| given).count() {
            0 => {
                return Err(Problem::key(
                    "height",
                    "is missing; name a height map, or a `builtin`, or a `mesh`",
                ));
            }
            1 => {}
            _ => return Err(Problem::key("height", "give only one of `height`, `builtin` and `mesh`")),
        }
        self.check_values()?;
        let misplaced = |given: bool, key, of| {
            if given {
                Err(Problem::key(key, format!("belongs to a `{of}`, which is not given")))
            } else {
                Ok(())
            }
        };
        if self.height.is_none() {
            misplaced(self.height_range.is_some(), "height_range", "height")?;
            misplaced(self.invert, "invert", "height")?;
            misplaced(self.normal.is_some(), "normal", "height")?;
            misplaced(self.tiling != Tiling::Require, "tiling", "height")?;
        }
        if self.builtin.is_some() {
            misplaced(self.albedo.is_some(), "albedo", "height")?;
            misplaced(self.roughness.is_some(), "roughness", "height")?;
            misplaced(self.metalness.is_some(), "metalness", "height")?;
        } else {
            misplaced(self.resolution.is_some(), "resolution", "builtin")?;
        }
        if self.mesh.is_none() {
            misplaced(self.period.is_some(), "period", "mesh")?;
            misplaced(self.up.is_some(), "up", "mesh")?;
        }
        if self.height.is_some() {
            self.check_complete()?;
        }
        Ok(())
    }

    /// What a height field cannot do without.
    fn check_complete(&self) -> Result<(), Problem> {
        if self.depth.is_none() {
            return Err(Problem::key(
                "depth",
                "is missing; say how deep the relief is, in tile lengths, such as 0.1",
            ));
        }
        if self.albedo.is_none() {
            return Err(Problem::key("albedo", "is missing; name a map, or give [red, green, blue]"));
        }
        if self.roughness.is_none() {
            return Err(Problem::key("roughness", "is missing; name a map, or give a number such as 0.6"));
        }
        Ok(())
    }

    fn check_values(&self) -> Result<(), Problem> {
        let unit = |x: f32| (0.0..=1.0).contains(&x);
        if let Some(depth) = self.depth
            && !(1e-6..=10.0).contains(&depth)
        {
            return Err(Problem::key(
                "depth",
                format!("{depth} is not between 0.000001 and 10 tile lengths"),
            ));
        }
        if let Some(n) = self.resolution
            && !(2..=MAX_RESOLUTION).contains(&n)
        {
            return Err(Problem::key("resolution", format!("{n} is not between 2 and {MAX_RESOLUTION}")));
        }
        if let Some([low, high]) = self.height_range
            && !(low.is_finite() && high.is_finite() && low < high && (high - low).is_finite())
        {
            return Err(Problem::key(
                "height_range",
                format!("[{low}, {high}] is no range from low to high"),
            ));
        }
        if let Some(MapOrValue::Value(c)) = &self.albedo
            && !c.iter().all(|&x| unit(x))
        {
            return Err(Problem::key("albedo", format!("{c:?} is not in [0, 1]")));
        }
        for (key, value) in [("roughness", &self.roughness), ("metalness", &self.metalness)] {
            if let Some(MapOrValue::Value(x)) = value
                && !unit(*x)
            {
                return Err(Problem::key(key, format!("{x} is not in [0, 1]")));
            }
        }
        if let Some(period) = self.period
            && !period.iter().all(|p| (1e-9..=1e9).contains(p))
        {
            return Err(Problem::key("period", format!("{period:?} is not positive")));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_names_the_key() {
        let field = "height = \"h.png\"\ndepth = 0.1\nalbedo = [0.5, 0.4, 0.3]\nroughness = 0.5\n";
        assert!(Spec::parse(field).is_ok());
        for (text, part) in [
            ("", "height: is missing"),
            ("builtin = \"cave\"\nheight = \"h.png\"", "only one"),
            ("builtin = \"cave\"\ndept = 1", "dept"),
            ("builtin = \"cave\"\nroughness = 0.5", "roughness: belongs to"),
            ("builtin = \"cave\"\nresolution = 1", "resolution: 1"),
            ("builtin = \"cave\"\nperiod = [1, 1]", "period: belongs to"),
            ("height = \"h.png\"\nalbedo = [0.5, 0.4, 0.3]\nroughness = 0.5", "depth: is missing"),
            ("height = \"h.png\"\ndepth = 0.1\nroughness = 0.5", "albedo: is missing"),
            ("height = \"h.png\"\ndepth = 0.1\nalbedo = \"a.png\"", "roughness: is missing"),
            ("height = \"h.png\"\ndepth = nan", "depth: NaN"),
            ("height = \"h.png\"\ndepth = 0", "depth: 0"),
            ("mesh = \"m.obj\"\nperiod = [0, 1]", "period: [0.0, 1.0]"),
            ("mesh = \"m.obj\"\nnormal = \"n.png\"", "normal: belongs to"),
        ] {
            let message = Spec::parse(text).unwrap_err().to_string();
            assert!(message.contains(part), "{text:?}: {message}");
        }
        for (line, part) in [
            ("roughness = 1.5", "roughness: 1.5"),
            ("albedo = [2, 0, 0]", "albedo: [2.0"),
            ("albedo = 0.5", "file name"),
            ("height_range = [1, 1]", "height_range: [1, 1]"),
            ("tiling = \"maybe\"", "maybe"),
        ] {
            let key = line.split(' ').next().unwrap();
            let kept: Vec<_> =
                field.lines().filter(|l| !l.starts_with(key) || key == "height_range").collect();
            let message = Spec::parse(&format!("{}\n{line}", kept.join("\n"))).unwrap_err().to_string();
            assert!(message.contains(part), "{line:?}: {message}");
        }
    }

    #[test]
    fn a_specification_survives_writing() {
        let text =
            "height = \"h.exr\"\ndepth = 0.25\nalbedo = \"a.png\"\nroughness = 0.5\ntiling = \"mirror\"";
        let spec = Spec::parse(text).unwrap();
        assert_eq!(Spec::parse(&toml::to_string(&spec).unwrap()).unwrap(), spec);
    }
}
