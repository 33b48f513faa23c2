//! [`Grid`]: values over one tile, and [`Maps`]: the reflectance parameters of a microstructure.

use glam::{Vec2, Vec3};

/// Values on a regular grid over the unit square, bilinear between texels and repeated outside.
///
/// Texel `(column, row)` has its centre at `((column + 0.5) / width, (row + 0.5) / height)`: rows go up with v.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid<T> {
    width: usize,
    height: usize,
    texels: Vec<T>,
}

impl<T: Copy> Grid<T> {
    /// Takes the texels row by row, the row at the lowest v first.
    ///
    /// # Panics
    ///
    /// If there are not `width * height` texels, or none.
    #[must_use]
    pub fn new(width: usize, height: usize, texels: Vec<T>) -> Self {
        assert!(!texels.is_empty() && texels.len() == width * height, "one value per texel");
        Self { width, height, texels }
    }

    /// Evaluates a function at the centre of every texel.
    pub fn from_fn(width: usize, height: usize, mut value: impl FnMut(Vec2) -> T) -> Self {
        let centre = |i: usize, n: usize| (i as f32 + 0.5) / n as f32;
        let texels = (0..width * height)
            .map(|i| value(Vec2::new(centre(i % width, width), centre(i / width, height))))
            .collect();
        Self::new(width, height, texels)
    }

    /// Texels along u.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Texels along v.
    #[must_use]
    pub fn height(&self) -> usize {
        self.height
    }

    /// All texels, row by row.
    #[must_use]
    pub fn texels(&self) -> &[T] {
        &self.texels
    }

    /// One texel.
    ///
    /// # Panics
    ///
    /// If it is outside the grid.
    #[must_use]
    pub fn texel(&self, column: usize, row: usize) -> T {
        assert!(column < self.width && row < self.height, "texel inside the grid");
        self.texels[row * self.width + column]
    }

    /// The grid and its mirror images along u, v and both: it tiles, whatever it was. `turn` takes a value and the signs of the
    /// mirrored axes, for values that have a direction.
    #[must_use]
    pub(crate) fn mirrored(&self, turn: impl Fn(T, f32, f32) -> T) -> Self {
        let (width, height) = (2 * self.width, 2 * self.height);
        let fold = |i: usize, n: usize| if i < n { (i, 1.0) } else { (2 * n - 1 - i, -1.0) };
        let texel = |i: usize| {
            let (x, sign_x) = fold(i % width, self.width);
            let (y, sign_y) = fold(i / width, self.height);
            turn(self.texel(x, y), sign_x, sign_y)
        };
        Self::new(width, height, (0..width * height).map(texel).collect())
    }

    /// The four texels around a point and the position between them, for a bilinear lookup: `[[t00, t10], [t01, t11]]`.
    ///
    /// UV that are not finite look up the corner.
    #[must_use]
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "wrapped into the grid first")]
    pub fn around(&self, uv: Vec2) -> ([[T; 2]; 2], Vec2) {
        // f32 keeps the position inside a tile to 2^-24 of the distance from the origin: at tile 1e6, 1/16.
        let axis = |x: f32, n: usize| {
            let inside = if x.is_finite() { x - x.floor() } else { 0.0 };
            let position = inside * n as f32 - 0.5;
            let first = position.floor();
            let low = if first < 0.0 { n - 1 } else { (first as usize).min(n - 1) };
            (low, if low + 1 == n { 0 } else { low + 1 }, position - first)
        };
        let (x0, x1, fx) = axis(uv.x, self.width);
        let (y0, y1, fy) = axis(uv.y, self.height);
        let at = |x: usize, y: usize| self.texels[y * self.width + x];
        ([[at(x0, y0), at(x1, y0)], [at(x0, y1), at(x1, y1)]], Vec2::new(fx, fy))
    }
}

impl Grid<f32> {
    /// The bilinear value at a point.
    #[must_use]
    pub fn lookup(&self, uv: Vec2) -> f32 {
        let ([[a, b], [c, d]], f) = self.around(uv);
        let (low, high) = (a + (b - a) * f.x, c + (d - c) * f.x);
        low + (high - low) * f.y
    }
}

impl Grid<Vec3> {
    /// The bilinear value at a point.
    #[must_use]
    pub fn lookup(&self, uv: Vec2) -> Vec3 {
        let ([[a, b], [c, d]], f) = self.around(uv);
        a.lerp(b, f.x).lerp(c.lerp(d, f.x), f.y)
    }
}

/// Reflectance at one point: a Lambert base under a GGX layer, or a GGX metal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reflectance {
    /// Linear RGB in `[0, 1]`: of the base, or of the metal at normal incidence.
    pub albedo: Vec3,
    /// Perceptual roughness in `[0, 1]`; GGX alpha is its square.
    pub roughness: f32,
    /// 0 for a dielectric, 1 for a metal.
    pub metalness: f32,
}

/// Reflectance parameters over one tile. Grids may have any size, also different ones.
#[derive(Debug, Clone, PartialEq)]
pub struct Maps {
    /// Linear RGB in `[0, 1]`.
    pub albedo: Grid<Vec3>,
    /// In `[0, 1]`.
    pub roughness: Grid<f32>,
    /// In `[0, 1]`.
    pub metalness: Grid<f32>,
    /// Unit normals in the tangent frame of the surface that the heights make (+z outward), finer than the heights; `None`
    /// where the heights say it all.
    pub normal: Option<Grid<Vec3>>,
}

impl Maps {
    /// The same reflectance everywhere.
    #[must_use]
    pub fn uniform(reflectance: Reflectance) -> Self {
        Self {
            albedo: Grid::new(1, 1, vec![reflectance.albedo]),
            roughness: Grid::new(1, 1, vec![reflectance.roughness]),
            metalness: Grid::new(1, 1, vec![reflectance.metalness]),
            normal: None,
        }
    }

    /// Reflectance at a point.
    #[must_use]
    pub fn reflectance(&self, uv: Vec2) -> Reflectance {
        Reflectance {
            albedo: self.albedo.lookup(uv),
            roughness: self.roughness.lookup(uv),
            metalness: self.metalness.lookup(uv),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lookups_hit_texel_centres_wrap_and_are_linear_between() {
        let grid = Grid::new(2, 3, vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        for tile in [0.0, 1.0, -7.0] {
            assert!((grid.lookup(Vec2::new(0.25 + tile, 0.5 / 3.0)) - 0.0).abs() < 1e-5);
            assert!((grid.lookup(Vec2::new(0.75 + tile, 2.5 / 3.0)) - 5.0).abs() < 1e-5);
            // Half-way between the last column and the first.
            assert!((grid.lookup(Vec2::new(tile, 0.5)) - 2.5).abs() < 1e-5);
        }
        assert!(grid.lookup(Vec2::new(f32::NAN, f32::INFINITY)).is_finite());
    }
}
