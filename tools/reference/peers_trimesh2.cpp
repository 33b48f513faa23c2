// trimesh2's estimator (Rusinkiewicz 2004), as a row of a study (see peers_common.hpp; peers.py compiles and runs this).
// It computes in single precision. Setting: `tensor`; normals are part of the time.
//
//   g++ -O3 -march=native -std=c++17 -I TRIMESH2/include peers_trimesh2.cpp TRIMESH2/libsrc/TriMesh_{curvature,normals,...}.cc

#include <TriMesh.h>

#include "peers_common.hpp"

static std::vector<Answer> tensors(trimesh::TriMesh& mesh) {
    mesh.normals.clear();
    mesh.pointareas.clear();
    mesh.cornerareas.clear();
    mesh.clear_curvatures();
    mesh.need_curvatures();
    std::vector<Answer> answers;
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
        // curv1 is the one of larger magnitude; the sign is ours.
        const bool swapped = mesh.curv1[v] < mesh.curv2[v];
        const auto& d = swapped ? mesh.pdir2[v] : mesh.pdir1[v];
        const double first = mesh.curv1[v], second = mesh.curv2[v];
        answers.push_back({std::max(first, second), std::min(first, second), d[0], d[1], d[2]});
    }
    return answers;
}

static Estimate prepare(const Input& mesh, const std::string&) {
    auto* own = new trimesh::TriMesh;
    for (const auto& p : mesh.points)
        own->vertices.emplace_back(static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2]));
    for (const auto& t : mesh.triangles) own->faces.emplace_back(t[0], t[1], t[2]);
    trimesh::TriMesh::set_verbose(0);
    return [own] { return tensors(*own); };
}

int main(int argc, char** argv) { return run(argc, argv, prepare); }
