//! From triangles to an eight-wide hierarchy: obvhs builds a binary one, which is collapsed here.

use glam::Vec3;
use obvhs::{BvhBuildParams, bvh2::Bvh2, triangle::Triangle};

use super::kernels::{NODE_WIDTH, Node, PACKET_WIDTH, Packet};

/// Marks a child that is a run of packets. Below it: 27 bits of first packet, 4 bits of packet count.
const LEAF_BIT: u32 = 1 << 31;
const COUNT_BITS: u32 = 4;

/// A child that does not exist: a leaf without packets. Its box is empty, so that no ray enters it.
const NO_CHILD: u32 = LEAF_BIT;

/// What a child reference stands for.
pub(super) enum Child {
    Node(usize),
    Packets(std::ops::Range<usize>),
}

impl Child {
    #[inline(always)]
    pub(super) fn decode(reference: u32) -> Self {
        if reference & LEAF_BIT == 0 {
            return Self::Node(reference as usize);
        }
        let first = ((reference & !LEAF_BIT) >> COUNT_BITS) as usize;
        Self::Packets(first..first + (reference & ((1 << COUNT_BITS) - 1)) as usize)
    }
}

/// An eight-wide hierarchy. Node 0 is the root, and present if there are triangles.
pub(super) struct WideTree {
    pub nodes: Vec<Node>,
    pub packets: Vec<Packet>,
    /// Most references that can be on the traversal stack at once.
    pub stack_size: usize,
}

/// Builds the hierarchy. The result depends on the triangles only.
pub(super) fn build(triangles: &[[Vec3; 3]]) -> WideTree {
    if triangles.is_empty() {
        return WideTree { nodes: Vec::new(), packets: Vec::new(), stack_size: 0 };
    }
    let for_obvhs: Vec<Triangle> =
        triangles.iter().map(|&[a, b, c]| Triangle { v0: a.into(), v1: b.into(), v2: c.into() }).collect();
    let params = BvhBuildParams {
        // Boxes of split triangles are rounded without care, which would break watertightness.
        pre_split: false,
        max_prims_per_leaf: reference_u32(PACKET_WIDTH),
        ..BvhBuildParams::medium_build()
    };
    let binary =
        obvhs::bvh2::builder::build_bvh2_from_tris(&for_obvhs, params, &mut std::time::Duration::default());
    let mut collapse =
        Collapse { binary: &binary, triangles, nodes: Vec::new(), packets: Vec::new(), depth: 0 };
    collapse.emit_tree();
    let stack_size = collapse.depth * (NODE_WIDTH - 1) + 1;
    WideTree { nodes: collapse.nodes, packets: collapse.packets, stack_size }
}

struct Collapse<'a> {
    binary: &'a Bvh2,
    triangles: &'a [[Vec3; 3]],
    nodes: Vec<Node>,
    packets: Vec<Packet>,
    depth: usize,
}

impl Collapse<'_> {
    /// Emits nodes depth first, so that a node's first child usually follows it in memory.
    fn emit_tree(&mut self) {
        self.nodes.push(Node::EMPTY);
        // Explicit stack: degenerate input makes trees too deep for recursion. (binary node, its wide node, depth)
        let mut pending = vec![(0_usize, 0_usize, 1_usize)];
        while let Some((root, index, depth)) = pending.pop() {
            self.depth = self.depth.max(depth);
            let group = self.children_of(root);
            for (slot, &child) in group.iter().enumerate() {
                let reference = if self.binary.nodes[child].is_leaf() {
                    self.emit_leaf(child)
                } else {
                    let next = self.nodes.len();
                    self.nodes.push(Node::EMPTY);
                    pending.push((child, next, depth + 1));
                    reference_u32(next)
                };
                let aabb = self.binary.nodes[child].aabb();
                self.nodes[index].set_child(slot, aabb.min.into(), aabb.max.into(), reference);
            }
        }
    }

    /// Up to eight descendants that cover `root`: the child with the largest surface is opened until there is no room.
    fn children_of(&self, root: usize) -> Vec<usize> {
        let node = |i: usize| &self.binary.nodes[i];
        if node(root).is_leaf() {
            return vec![root];
        }
        let mut group = vec![node(root).first_index as usize, node(root).first_index as usize + 1];
        while group.len() < NODE_WIDTH {
            let area = |i: usize| node(i).aabb().half_area();
            let candidates = group.iter().enumerate().filter(|&(_, &i)| !node(i).is_leaf());
            let Some((slot, &open)) = candidates.max_by(|a, b| area(*a.1).total_cmp(&area(*b.1))) else {
                break;
            };
            let first = node(open).first_index as usize;
            group[slot] = first;
            group.push(first + 1);
        }
        group
    }

    fn emit_leaf(&mut self, leaf: usize) -> u32 {
        let node = &self.binary.nodes[leaf];
        let first = node.first_index as usize;
        let ids = &self.binary.primitive_indices[first..first + node.prim_count as usize];
        let start = self.packets.len();
        for chunk in ids.chunks(PACKET_WIDTH) {
            self.packets.push(Packet::new(chunk, self.triangles));
        }
        let count = self.packets.len() - start;
        assert!(count < 1 << COUNT_BITS, "obvhs made a leaf of {} triangles", ids.len());
        assert!(start < 1 << (31 - COUNT_BITS), "{start} packets are more than a node can name");
        LEAF_BIT | reference_u32(start) << COUNT_BITS | reference_u32(count)
    }
}

impl Node {
    /// A node without children.
    const EMPTY: Self = Self {
        rows: [
            [f32::INFINITY; NODE_WIDTH],
            [f32::NEG_INFINITY; NODE_WIDTH],
            [f32::INFINITY; NODE_WIDTH],
            [f32::NEG_INFINITY; NODE_WIDTH],
            [f32::INFINITY; NODE_WIDTH],
            [f32::NEG_INFINITY; NODE_WIDTH],
        ],
        children: [NO_CHILD; NODE_WIDTH],
    };

    /// Enters a child, with a margin around its box.
    ///
    /// The edge functions of the triangle test are rounded relative to the triangle's size, so a ray that passes a vertex
    /// just outside the exact box can count as a hit. The margin, 16 roundings of the box's extent, covers that; without it
    /// the neighbour's box would be tested and the right triangle missed.
    fn set_child(&mut self, slot: usize, lower: Vec3, upper: Vec3, reference: u32) {
        let margin = (upper - lower).max_element() * (1.0 / 1_048_576.0);
        for axis in 0..3 {
            self.rows[2 * axis][slot] = (lower[axis] - margin).next_down();
            self.rows[2 * axis + 1][slot] = (upper[axis] + margin).next_up();
        }
        self.children[slot] = reference;
    }
}

impl Packet {
    /// Packs one to four triangles; free lanes repeat the first, which changes no answer.
    fn new(ids: &[u32], triangles: &[[Vec3; 3]]) -> Self {
        let mut packet = Self { corners: [[[0.0; PACKET_WIDTH]; 3]; 3], ids: [0; PACKET_WIDTH] };
        for lane in 0..PACKET_WIDTH {
            let id = *ids.get(lane).unwrap_or(&ids[0]);
            packet.ids[lane] = id;
            for (corner, position) in triangles[id as usize].iter().enumerate() {
                for axis in 0..3 {
                    packet.corners[corner][axis][lane] = position[axis];
                }
            }
        }
        packet
    }
}

fn reference_u32(index: usize) -> u32 {
    u32::try_from(index).expect("a mesh has at most 2^32 triangles, so fewer nodes")
}
