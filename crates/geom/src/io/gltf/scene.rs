//! The nodes of a glTF file, flattened to meshes with their transforms.

use ::gltf::json::mesh::Mesh;
use ::gltf::json::scene::Node;
use ::gltf::json::{Index, Root};
use nalgebra::{Matrix4, Quaternion, UnitQuaternion, Vector3};

use super::GltfError;
use super::file::{item, label};
use crate::io::warnings::Warnings;

/// One use of a mesh.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Instance {
    pub mesh: Index<Mesh>,
    /// Affine; the last row is `0 0 0 1`.
    pub world_from_object: Matrix4<f64>,
    /// For messages.
    pub node: String,
}

impl PartialEq<usize> for Instance {
    fn eq(&self, other: &usize) -> bool {
        self.mesh.value() == *other
    }
}

/// The meshes of the default scene in depth-first order; of the first scene without a default; of all nodes without a
/// scene; all meshes as they are without nodes.
pub(super) fn instances(root: &Root, warnings: &mut Warnings) -> Result<Vec<Instance>, GltfError> {
    let parents = check_tree(root)?;
    let scene = match root.scene {
        Some(scene) => Some(item(&root.scenes, scene, "scene", &"scene")?),
        None => root.scenes.first(),
    };
    let roots: Vec<Index<Node>> = match scene {
        Some(scene) => scene.nodes.clone(),
        None => (0..).zip(&parents).filter(|(_, p)| p.is_none()).map(|(i, _)| Index::new(i)).collect(),
    };
    if root.nodes.is_empty() {
        let plain = |mesh| Instance {
            mesh: Index::new(mesh),
            world_from_object: Matrix4::identity(),
            node: "scene".into(),
        };
        return Ok((0..).zip(&root.meshes).map(|(i, _)| plain(i)).collect());
    }
    let mut instances = Vec::new();
    let mut visited = vec![false; root.nodes.len()];
    let mut stack: Vec<(Index<Node>, Matrix4<f64>)> =
        roots.into_iter().rev().map(|node| (node, Matrix4::identity())).collect();
    while let Some((index, world_from_parent)) = stack.pop() {
        let node = item(&root.nodes, index, "node", &"the scene")?;
        // A scene may list a node and its parent, or a node twice; it is there once.
        if std::mem::replace(&mut visited[index.value()], true) {
            continue;
        }
        let world_from_node = world_from_parent * parent_from_node(node);
        let name = node_label(root, index.value());
        if !world_from_node.iter().all(|x| x.is_finite()) {
            return Err(GltfError::BadTransform { node: name });
        }
        if node.skin.is_some() {
            warnings
                .add("skin", || format!("{name} has a skin; its mesh is read in the pose it was bound in"));
        }
        if let Some(mesh) = node.mesh {
            instances.push(Instance { mesh, world_from_object: world_from_node, node: name });
        }
        stack.extend(node.children.iter().flatten().rev().map(|&child| (child, world_from_node)));
    }
    Ok(instances)
}

/// The parent of each node, once it is sure that nodes form trees.
fn check_tree(root: &Root) -> Result<Vec<Option<usize>>, GltfError> {
    let mut parents: Vec<Option<usize>> = vec![None; root.nodes.len()];
    for (number, node) in root.nodes.iter().enumerate() {
        for &child in node.children.iter().flatten() {
            item(&root.nodes, child, "node", &format_args!("the children of {}", node_label(root, number)))?;
            if let Some(first) = parents[child.value()].replace(number) {
                return Err(GltfError::TwoParents {
                    node: node_label(root, child.value()),
                    first: node_label(root, first),
                    second: node_label(root, number),
                });
            }
        }
    }
    // Every node has one parent at most, so walking up either ends or runs into its own path.
    let mut checked_by = vec![usize::MAX; root.nodes.len()];
    for start in 0..root.nodes.len() {
        let mut node = Some(start);
        while let Some(number) = node {
            match std::mem::replace(&mut checked_by[number], start) {
                usize::MAX => node = parents[number],
                earlier if earlier == start => {
                    return Err(GltfError::CyclicNode { node: node_label(root, number) });
                }
                earlier => {
                    checked_by[number] = earlier;
                    break;
                }
            }
        }
    }
    Ok(parents)
}

fn node_label(root: &Root, number: usize) -> String {
    label("node", number, root.nodes.get(number).and_then(|n| n.name.as_ref()))
}

fn parent_from_node(node: &Node) -> Matrix4<f64> {
    if let Some(matrix) = node.matrix {
        let mut matrix = Matrix4::from_column_slice(&matrix.map(f64::from));
        matrix.set_row(3, &nalgebra::RowVector4::new(0.0, 0.0, 0.0, 1.0));
        return matrix;
    }
    let translation = Vector3::from(node.translation.unwrap_or_default().map(f64::from));
    let scale = Vector3::from(node.scale.unwrap_or([1.0; 3]).map(f64::from));
    let [x, y, z, w] = node.rotation.unwrap_or_default().0.map(f64::from);
    // In f32 a quaternion is only unit to 1e-7, which would scale the mesh; a zero one says nothing.
    let rotation = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 0.0).unwrap_or_default();
    Matrix4::new_translation(&translation)
        * rotation.to_homogeneous()
        * Matrix4::new_nonuniform_scaling(&scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(json: &str) -> Result<Vec<Instance>, GltfError> {
        let json = format!(r#"{{"asset":{{"version":"2.0"}},{json}}}"#);
        instances(&Root::from_slice(json.as_bytes()).unwrap(), &mut Warnings::default())
    }

    #[test]
    fn transforms_multiply_down_the_tree() {
        let nodes = r#""nodes":[{"mesh":0,"translation":[1,0,0],"children":[1]},
            {"mesh":1,"rotation":[0,0,0.70710678,0.70710678],"scale":[2,2,2]}],"scenes":[{"nodes":[0]}]"#;
        let found = scene(nodes).unwrap();
        assert_eq!(found, [0, 1]);
        let p = found[1].world_from_object.transform_point(&nalgebra::Point3::new(1.0, 0.0, 3.0));
        assert!((p - nalgebra::Point3::new(1.0, 2.0, 6.0)).norm() < 1e-14, "{p}");
    }

    #[test]
    fn which_nodes_are_read() {
        let nodes = r#""nodes":[{"mesh":0},{"mesh":1,"children":[2]},{"mesh":2}]"#;
        assert_eq!(scene(nodes).unwrap(), [0, 1, 2]);
        assert_eq!(scene(&format!(r#"{nodes},"scenes":[{{"nodes":[2]}},{{"nodes":[0]}}]"#)).unwrap(), [2]);
        assert_eq!(
            scene(&format!(r#"{nodes},"scene":1,"scenes":[{{"nodes":[2]}},{{"nodes":[0,0]}}]"#)).unwrap(),
            [0]
        );
        assert_eq!(scene(r#""meshes":[{"primitives":[]}]"#).unwrap(), [0]);
    }

    #[test]
    fn what_is_no_tree_is_refused() {
        let message = |json: &str| scene(json).unwrap_err().to_string();
        let cycle = r#""nodes":[{},{"name":"a","children":[2]},{"name":"b","children":[1]}]"#;
        assert_eq!(message(cycle), "node 1 \"a\" is below itself; nodes must form a tree");
        assert!(message(r#""nodes":[{"children":[0]}]"#).starts_with("node 0 is below itself"));
        let twice = r#""nodes":[{"children":[2]},{"children":[2]},{}]"#;
        assert!(message(twice).starts_with("node 2 is a child of both node 0 and node 1"));
        assert_eq!(message(r#""nodes":[{"children":[9]}]"#), "the children of node 0 names node 9 of 1");
        assert_eq!(message(r#""nodes":[{}],"scene":3"#), "scene names scene 3 of 0");
        // Each scale is a valid float; nine of them multiply to more than an f64 holds.
        let nodes = (0..9).map(|n| format!(r#"{{"scale":[1e38,1,1],"children":[{}]}}"#, n + 1));
        let deep = format!(r#""nodes":[{},{{"mesh":0}}]"#, nodes.collect::<Vec<_>>().join(","));
        assert!(message(&deep).starts_with("the transform of node 8 is not finite"), "{}", message(&deep));
    }
}
