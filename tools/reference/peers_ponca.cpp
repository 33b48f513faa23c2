// Ponca's fits of algebraic spheres, as rows of a study (see peers_common.hpp; peers.py compiles and runs this).
//
//   asoX     Algebraic Shape Operator (Lejemble et al. 2021) at a scale of X mean edges
//   apssX    curvature of the algebraic point set surface (Guennebaud and Gross 2007) at that scale
//
// Normals are the mesh's own, weighted by area; they and the k-d tree are part of the time.
// Header only: g++ -O3 -march=native -std=c++17 -I EIGEN -I PONCA peers_ponca.cpp

#include <Ponca/Fitting>
#include <Ponca/SpatialPartitioning>
#include <Ponca/src/Common/pointTypes.h>

#include "peers_common.hpp"

using Oriented = Ponca::PointPositionNormal<double, 3>;
using Vector = Oriented::VectorType;
using Weight = Ponca::DistWeightFunc<Oriented, Ponca::SmoothWeightKernel<double>>;
using Sphere = Ponca::Basket<Oriented, Weight, Ponca::OrientedSphereFit>;
using Apss = Ponca::BasketDiff<Sphere, Ponca::FitSpaceDer, Ponca::OrientedSphereDer, Ponca::CurvatureEstimatorDer,
                               Ponca::NormalDerivativeWeingartenEstimator, Ponca::WeingartenCurvatureEstimatorDer>;
using Aso = Ponca::BasketDiff<Sphere, Ponca::FitSpaceDer, Ponca::OrientedSphereDer, Ponca::MlsSphereFitDer,
                              Ponca::CurvatureEstimatorDer, Ponca::NormalDerivativeWeingartenEstimator,
                              Ponca::WeingartenCurvatureEstimatorDer>;

template <typename Fit>
static std::vector<Answer> estimate(const Input& mesh, double scale) {
    const auto normals = vertex_normals(mesh);
    std::vector<Oriented> points;
    points.reserve(mesh.points.size());
    for (std::size_t v = 0; v < mesh.points.size(); ++v)
        points.emplace_back(Vector(mesh.points[v].data()), Vector(normals[v].data()));
    const Ponca::KdTreeDense<Oriented> tree(points);
    std::vector<Answer> answers(points.size(), no_answer());
    for (std::size_t v = 0; v < points.size(); ++v) {
        Fit fit;
        fit.setNeighborFilter({points[v].pos(), scale});
        fit.init();
        fit.addNeighbor(points[v]);  // the tree leaves out the point itself
        for (int i : tree.rangeNeighbors(static_cast<int>(v), scale)) fit.addNeighbor(points[i]);
        if (fit.finalize() != Ponca::STABLE) continue;
        const Vector d = fit.kmaxDirection().normalized();
        answers[v] = {fit.kmax(), fit.kmin(), d.x(), d.y(), d.z()};
    }
    return answers;
}

static Estimate prepare(const Input& mesh, const std::string& setting) {
    const double edge = mean_edge(mesh);
    const double aso = number_after(setting, "aso"), apss = number_after(setting, "apss");
    if (aso > 0) return [=, &mesh] { return estimate<Aso>(mesh, aso * edge); };
    if (apss > 0) return [=, &mesh] { return estimate<Apss>(mesh, apss * edge); };
    std::fprintf(stderr, "%s: write asoX or apssX\n", setting.c_str());
    std::exit(2);
}

int main(int argc, char** argv) { return run(argc, argv, prepare); }
