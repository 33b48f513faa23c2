//! What identifies a material: a hash of all that its reflectance depends on.

use glam::Vec3;
use sha2::{Digest as _, Sha256};

use super::{Geometry, Grid, HeightField, Microstructure, TileMesh};

impl Microstructure {
    /// SHA-256 of geometry and maps, in hexadecimal digits. The name does not count, nor does the file that it came from.
    ///
    /// Stable between versions as long as the numbers are; procedural materials use the platform's trigonometric functions, whose last
    /// digits may differ between platforms.
    #[must_use]
    pub fn hash(&self) -> String {
        let mut hasher = Hasher(Sha256::new());
        match &self.geometry {
            Geometry::HeightField(field) => hasher.field(field),
            Geometry::TileMesh(mesh) => hasher.mesh(mesh),
        }
        hasher.0.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

struct Hasher(Sha256);

impl Hasher {
    fn field(&mut self, field: &HeightField) {
        self.0.update(b"height field 1");
        self.numbers(&[field.depth()]);
        self.grid(field.heights(), |&x| [x; 1]);
        let maps = field.maps();
        self.grid(&maps.albedo, Vec3::to_array);
        self.grid(&maps.roughness, |&x| [x; 1]);
        self.grid(&maps.metalness, |&x| [x; 1]);
        self.count(usize::from(maps.normal.is_some()));
        if let Some(normal) = &maps.normal {
            self.grid(normal, Vec3::to_array);
        }
    }

    fn mesh(&mut self, mesh: &TileMesh) {
        self.0.update(b"tile mesh 1");
        self.numbers(&[mesh.depth()]);
        for vectors in [Some(mesh.positions()), Some(mesh.normals()), mesh.tints()] {
            let vectors = vectors.unwrap_or_default();
            self.count(vectors.len());
            vectors.iter().for_each(|v| self.numbers(&v.to_array()));
        }
        self.count(mesh.triangles().len());
        for triangle in mesh.triangles() {
            triangle.vertices.iter().chain([&triangle.material]).for_each(|i| self.0.update(i.to_le_bytes()));
        }
        self.count(mesh.materials().len());
        for m in mesh.materials() {
            self.numbers(&m.albedo.to_array());
            self.numbers(&[m.roughness, m.metalness]);
        }
    }

    /// Sizes come first, so that no two materials give the same bytes.
    fn grid<T: Copy, const N: usize>(&mut self, grid: &Grid<T>, numbers: impl Fn(&T) -> [f32; N]) {
        self.count(grid.width());
        self.count(grid.height());
        grid.texels().iter().for_each(|texel| self.numbers(&numbers(texel)));
    }

    fn count(&mut self, n: usize) {
        self.0.update((n as u64).to_le_bytes());
    }

    fn numbers(&mut self, numbers: &[f32]) {
        // Adding 0 makes -0 one with 0.
        numbers.iter().for_each(|x| self.0.update((x + 0.0).to_le_bytes()));
    }
}

#[cfg(test)]
mod tests {
    use super::super::*;
    use glam::Vec3;

    fn micro(heights: Vec<f32>, depth: f32, albedo: f32) -> Microstructure {
        let reflectance = Reflectance { albedo: Vec3::splat(albedo), roughness: 0.5, metalness: 0.0 };
        let field = HeightField::new(Grid::new(2, 1, heights), depth, Maps::uniform(reflectance));
        Microstructure { name: "any".into(), geometry: Geometry::HeightField(field) }
    }

    #[test]
    fn everything_but_the_name_counts() {
        let base = micro(vec![0.0, 1.0], 0.1, 0.5).hash();
        assert_eq!(base.len(), 64);
        assert_eq!(Microstructure { name: "other".into(), ..micro(vec![-0.0, 1.0], 0.1, 0.5) }.hash(), base);
        assert_ne!(micro(vec![0.0, 0.9], 0.1, 0.5).hash(), base);
        assert_ne!(micro(vec![0.0, 1.0], 0.2, 0.5).hash(), base);
        assert_ne!(micro(vec![0.0, 1.0], 0.1, 0.6).hash(), base);
    }
}
