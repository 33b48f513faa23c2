//! Irregular meshes of the study's surfaces.

use std::f64::consts::{PI, TAU};

use spade::{DelaunayTriangulation, HasPosition, Point2, Triangulation};

use super::StudyShape;
use super::random::Random;
use super::surface::{HALF_AXES, MAJOR, MINOR, point};
use crate::mesh::index_u32;
use crate::{Mesh, Vec3};

/// A mesh of about this many vertices.
pub(super) fn mesh(shape: StudyShape, vertices: usize, seed: u64) -> Mesh {
    let mut random = Random::new(seed);
    let (positions, triangles) = match shape {
        StudyShape::Sphere => sphere(vertices, &mut random),
        StudyShape::Ellipsoid => {
            let (points, triangles) = sphere(vertices, &mut random);
            let axes = Vec3::from(HALF_AXES);
            (points.into_iter().map(|p| p.component_mul(&axes)).collect(), triangles)
        }
        StudyShape::Torus => torus(vertices, &mut random),
        StudyShape::Catenoid | StudyShape::Cylinder => {
            // TAU by 2 in parameters that stretch both directions alike, so square cells.
            let rows = (vertices as f64 / PI).sqrt();
            grid(shape, [whole(PI * rows), whole(rows - 1.0)], Around::Closed, &mut random)
        }
        StudyShape::Bump | StudyShape::MonkeySaddle => {
            let cells = whole((vertices as f64).sqrt() - 1.0);
            grid(shape, [cells; 2], Around::Open, &mut random)
        }
    };
    Mesh::new(positions, triangles).expect("finite points and triangles between them")
}

/// The nearest count, at least 3.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a vertex count's square root")]
fn whole(x: f64) -> usize {
    x.round().max(3.0) as usize
}

/// A point with the number of its vertex, for a triangulation that reorders.
struct Site {
    at: Point2<f64>,
    vertex: u32,
}

impl HasPosition for Site {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.at
    }
}

fn delaunay(sites: Vec<Site>) -> DelaunayTriangulation<Site> {
    DelaunayTriangulation::bulk_load(sites).expect("coordinates are finite and within spade's range")
}

/// Numbers strip by strip: `strip` has one entry per point, `along` orders the points of a strip.
fn in_strips<T: Copy>(points: &mut [T], place: impl Fn(&T) -> [f64; 2], size: [f64; 2]) {
    let strips = (points.len() as f64 * size[1] / size[0]).sqrt().max(1.0);
    let key = |p: &T| {
        let [along, across] = place(p);
        ((across / size[1] * strips).floor(), along)
    };
    points.sort_by(|a, b| {
        let ((strip_a, a), (strip_b, b)) = (key(a), key(b));
        strip_a.total_cmp(&strip_b).then(a.total_cmp(&b))
    });
}

/// Triangles in the order of their first vertex, which comes first: the order of a triangulation's faces means nothing.
fn ordered(mut triangles: Vec<[u32; 3]>) -> Vec<[u32; 3]> {
    for t in &mut triangles {
        let first = (0..3).min_by_key(|&i| t[i]).unwrap_or(0);
        t.rotate_left(first);
    }
    triangles.sort_unstable();
    triangles
}

/// Uniformly random points of the unit sphere and their Delaunay triangulation, which is their convex hull.
///
/// Seen from one of the points, stereographic projection turns circles on the sphere into circles and lines of the plane.
/// So the triangulation of the other points in the plane is that of the sphere, but for the triangles at the centre of
/// projection: it sees exactly the edges of the plane's convex hull.
fn sphere(count: usize, random: &mut Random) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let mut points: Vec<Vec3> = (0..count)
        .map(|_| {
            // Equal heights cut equal areas from a sphere (Archimedes).
            let (y, longitude) = (random.signed(), PI * random.signed());
            let rho = ((1.0 - y) * (1.0 + y)).sqrt();
            Vec3::new(rho * longitude.sin(), y, rho * longitude.cos())
        })
        .collect();
    in_strips(&mut points, |p| [p.x.atan2(p.z), p.y + 1.0], [TAU, 2.0]);
    let pole = points[0];
    let axis = Vec3::ith(pole.iamin(), 1.0);
    let e1 = axis.cross(&pole).normalize();
    let e2 = pole.cross(&e1);
    let project = |p: &Vec3| {
        let away = 1.0 - p.dot(&pole);
        Point2::new(p.dot(&e1) / away, p.dot(&e2) / away)
    };
    let others = points.iter().enumerate().skip(1);
    let plane = delaunay(others.map(|(i, p)| Site { at: project(p), vertex: index_u32(i) }).collect());
    let corner = |v: spade::handles::VertexHandle<'_, Site>| v.data().vertex;
    // Counter-clockwise seen along the pole from inside is clockwise from outside.
    let faces = plane.inner_faces().map(|f| f.vertices().map(corner)).map(|[a, b, c]| [a, c, b]);
    // Hull edges have the outside on their left.
    let at_pole = plane.convex_hull().map(|e| [0, corner(e.to()), corner(e.from())]);
    let triangles = ordered(faces.chain(at_pole).collect());
    (points, triangles)
}

/// Points of the torus, uniformly random by area, and their Delaunay triangulation in conformal parameters, in which a
/// small circle is a circle on the surface.
///
/// The metric is `(R + r cos v)^2 (du^2 + dw^2)` with `w = r int dv / (R + r cos v)`
/// `= 2 r / sqrt(R^2 - r^2) atan(sqrt((R - r) / (R + r)) tan(v / 2))`.
fn torus(count: usize, random: &mut Random) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let root = ((MAJOR - MINOR) * (MAJOR + MINOR)).sqrt();
    let narrow = ((MAJOR - MINOR) / (MAJOR + MINOR)).sqrt();
    let conformal = |v: f64| 2.0 * MINOR / root * (narrow * (0.5 * v).tan()).atan();
    let periods = [TAU, TAU * MINOR / root].map(quantise);
    let mut angles: Vec<[f64; 2]> = Vec::with_capacity(count);
    while angles.len() < count {
        let (u, v) = (PI * random.signed(), PI * random.signed());
        if random.unit() * (MAJOR + MINOR) < MAJOR + MINOR * v.cos() {
            angles.push([u, v]);
        }
    }
    in_strips(&mut angles, |&[u, v]| [u, v + PI], [TAU * MAJOR, TAU * MINOR]);
    let places: Vec<[f64; 2]> = angles.iter().map(|&[u, v]| [quantise(u), quantise(conformal(v))]).collect();
    let triangles = periodic_delaunay(&places, periods);
    (angles.iter().map(|&[u, v]| point(StudyShape::Torus, u, v)).collect(), triangles)
}

/// Rounded to a multiple of 2^-40, so that adding a period is exact and a copy has the same triangles to the bit.
fn quantise(x: f64) -> f64 {
    let steps = (1_u64 << 40) as f64;
    (x * steps).round() / steps
}

/// Delaunay triangulation of points in the rectangle `[-p/2, p/2]` whose opposite sides are one.
fn periodic_delaunay(places: &[[f64; 2]], periods: [f64; 2]) -> Vec<[u32; 3]> {
    // The largest empty circle among n random points has a radius of about sqrt(ln n / pi) spacings, 2.1 for two million;
    // on this torus the density varies by up to 2.3. A triangle reaches twice as far. Copies beyond that change nothing.
    let spacing = (periods[0] * periods[1] / places.len() as f64).sqrt();
    let margin = periods.map(|p| p.min(16.0 * spacing));
    let mut sites = Vec::with_capacity(2 * places.len());
    for du in [0.0, -1.0, 1.0] {
        for dw in [0.0, -1.0, 1.0] {
            for (i, [u, w]) in places.iter().enumerate() {
                let at = [u + du * periods[0], w + dw * periods[1]];
                if (0..2).all(|k| at[k].abs() <= 0.5 * periods[k] + margin[k]) {
                    sites.push(Site { at: Point2::new(at[0], at[1]), vertex: index_u32(i) });
                }
            }
        }
    }
    let plane = delaunay(sites);
    let faces = plane.inner_faces().filter_map(|face| {
        let corners = face.vertices();
        // Of the copies of a triangle, the one whose smallest vertex is no copy.
        let first = corners.iter().min_by_key(|v| v.data().vertex)?;
        let place = places[first.data().vertex as usize];
        let at = first.position();
        #[expect(clippy::float_cmp, reason = "copies are moved by whole periods, exactly")]
        let is_original = at.x == place[0] && at.y == place[1];
        is_original.then(|| corners.map(|v| v.data().vertex))
    });
    ordered(faces.collect())
}

/// Whether the first direction of a grid closes on itself.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Around {
    Closed,
    Open,
}

/// A grid over the shape's parameters, `[0, TAU]` by `[-1, 1]` if closed, else `[-1, 1]^2`: every vertex moved at random
/// within its cell (along the boundary if it is there), every cell cut along a random diagonal.
fn grid(
    shape: StudyShape,
    cells: [usize; 2],
    around: Around,
    random: &mut Random,
) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    // With a quarter of a cell every triangle keeps its orientation; with more, two neighbours could fold one over.
    const JITTER: f64 = 0.25;
    let columns = cells[0] + usize::from(around == Around::Open);
    let mut positions = Vec::with_capacity(columns * (cells[1] + 1));
    for j in 0..=cells[1] {
        for i in 0..columns {
            let (du, dv) = (JITTER * random.signed(), JITTER * random.signed());
            let at_side = around == Around::Open && (i == 0 || i == cells[0]);
            let at_end = j == 0 || j == cells[1];
            let u = (i as f64 + if at_side { 0.0 } else { du }) / cells[0] as f64;
            let v = (j as f64 + if at_end { 0.0 } else { dv }) / cells[1] as f64;
            let u = if around == Around::Closed { TAU * u } else { 2.0 * u - 1.0 };
            positions.push(point(shape, u, 2.0 * v - 1.0));
        }
    }
    let index = |i: usize, j: usize| index_u32(j * columns + i % columns);
    let mut triangles = Vec::with_capacity(2 * cells[0] * cells[1]);
    for j in 0..cells[1] {
        for i in 0..cells[0] {
            let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
            triangles.extend(if random.unit() < 0.5 {
                [[a, b, c], [a, c, d]]
            } else {
                [[a, b, d], [b, c, d]]
            });
        }
    }
    (positions, triangles)
}
