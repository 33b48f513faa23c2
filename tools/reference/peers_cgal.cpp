// CGAL's two estimators, as rows of a study (see peers_common.hpp for arguments and result; peers.py compiles and runs this).
//
//   jetDrR    Monge_via_jet_fitting of degree D over R rings (Cazals and Pouget 2003), e.g. jet4r3
//   icc       interpolated_corrected_curvatures (Lachaud et al. 2020), CGAL 6; iccX: in a ball of X mean edges
//
// Needs CGAL 6 and Eigen 3.4, headers only: g++ -O3 -march=native -std=c++17 -I EIGEN -I CGAL peers_cgal.cpp -lgmp -lmpfr

#define CGAL_EIGEN3_ENABLED

#include <CGAL/Monge_via_jet_fitting.h>
#include <CGAL/Polygon_mesh_processing/interpolated_corrected_curvatures.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>

#include <memory>

#include "peers_common.hpp"

using Kernel = CGAL::Simple_cartesian<double>;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
using Jet = CGAL::Monge_via_jet_fitting<Kernel, Kernel>;
namespace PMP = CGAL::Polygon_mesh_processing;

static Kernel::Point_3 point(const Point& p) { return {p[0], p[1], p[2]}; }

// Curvatures of a Monge form are of the height along the normal, so their signs are the opposite of ours.
static std::vector<Answer> jets(const Input& mesh, int degree, int rings) {
    const std::size_t least = static_cast<std::size_t>((degree + 1) * (degree + 2) / 2);
    const auto normals = vertex_normals(mesh);
    Rings neighbours(mesh);
    std::vector<Kernel::Point_3> points;
    std::vector<Answer> answers(mesh.points.size(), no_answer());
    for (std::size_t v = 0; v < mesh.points.size(); ++v) {
        points.clear();
        for (int i : neighbours.around(static_cast<int>(v), rings, least)) points.push_back(point(mesh.points[i]));
        if (points.size() < least) continue;
        Jet fit;
        auto form = fit(points.begin(), points.end(), static_cast<std::size_t>(degree), 2);
        form.comply_wrt_given_normal(Kernel::Vector_3(normals[v][0], normals[v][1], normals[v][2]));
        const auto d = form.minimal_principal_direction();
        answers[v] = {-form.principal_curvatures(1), -form.principal_curvatures(0), d.x(), d.y(), d.z()};
    }
    return answers;
}

static std::vector<Answer> corrected(const Mesh& mesh, double radius) {
    using Principal = PMP::Principal_curvatures_and_directions<Kernel>;
    boost::vector_property_map<Principal> found;
    auto map = CGAL::parameters::vertex_principal_curvatures_and_directions_map(found);
    if (radius > 0) PMP::interpolated_corrected_curvatures(mesh, map.ball_radius(radius));
    else PMP::interpolated_corrected_curvatures(mesh, map);
    std::vector<Answer> answers;
    for (auto v : mesh.vertices()) {
        const auto& p = get(found, v);
        const auto& d = p.max_direction;
        answers.push_back({p.max_curvature, p.min_curvature, d.x(), d.y(), d.z()});
    }
    return answers;
}

static Estimate prepare(const Input& mesh, const std::string& setting) {
    int degree = 0, rings = 0;
    if (std::sscanf(setting.c_str(), "jet%dr%d", &degree, &rings) == 2) return [=, &mesh] { return jets(mesh, degree, rings); };
    auto own = std::make_shared<Mesh>();
    for (const auto& p : mesh.points) own->add_vertex(point(p));
    for (const auto& t : mesh.triangles) {
        using V = Mesh::Vertex_index;
        own->add_face(V(static_cast<unsigned>(t[0])), V(static_cast<unsigned>(t[1])), V(static_cast<unsigned>(t[2])));
    }
    const double radius = number_after(setting, "icc") * mean_edge(mesh);
    return [=] { return corrected(*own, radius); };
}

int main(int argc, char** argv) { return run(argc, argv, prepare); }
