// Rays per second of Embree 3 on one thread, for comparison.
//
//   g++ -O3 -march=native -std=c++17 embree_rays.cpp -o embree_rays -lembree3      (Debian's libembree-dev)
//   ./embree_rays MESH.ply [RUNS=5]
//
// Reads a binary little-endian PLY: float or double x, y, z first among the vertex properties, triangles as
// a list of int or uint with a uchar count. Prints JSON; million rays a second are medians over RUNS runs.
//
// The rays, so that other programs can shoot the same ones:
//   Box        lo and hi of the positions as float; centre = (lo + hi) / 2, diag = |hi - lo|, in double.
//   primary    1024 x 1024, one ray through each pixel's centre, rows from the top. The eye is at
//              centre + 1.6 diag normalise(0, 0.35, 1) and looks at the centre, up is +Y, vertical field of view 40
//              degrees, image square: with f = normalise(centre - eye), r = normalise(f x up), u = r x f and
//              t = tan(20 degrees), pixel (x, y) has the direction
//              normalise(f + t (2 (x + 0.5) / 1024 - 1) r + t (1 - 2 (y + 0.5) / 1024) u), computed in double, cast to float.
//   random     one ray for every primary hit, in pixel order: from the hit point p = eye + distance * direction moved by
//              1e-4 diag along the geometric normal n that faces the viewer, in a cosine-weighted direction: with
//              a, b = uniform(2 i), uniform(2 i + 1), i the pixel's index, phi = 2 pi a,
//              d = sqrt(b) cos(phi) s + sqrt(b) sin(phi) t + sqrt(1 - b) n; s = normalise(n x e) with e the unit axis of the
//              smallest |component| of n (x before y before z), t = n x s. Rays are in pixel order, so neighbours start close
//              together but go anywhere.
//   uniform(k) h = k as 32-bit; h ^= h >> 16; h *= 0x7feb352d; h ^= h >> 15; h *= 0x846ca68b; h ^= h >> 16;
//              (h >> 8) * 2^-24.
// Both kinds ask for the closest hit, tnear 0, tfar infinity, one ray a call (rtcIntersect1). Robust mode on, as for
// a watertight tracer. Building the tree and making the rays are not timed.

#include <embree3/rtcore.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

struct Vec {
    double x, y, z;
};
static Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
static Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
static Vec operator*(double s, Vec a) { return {s * a.x, s * a.y, s * a.z}; }
static double dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static Vec cross(Vec a, Vec b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
static Vec normalise(Vec a) { return 1.0 / std::sqrt(dot(a, a)) * a; }

struct Mesh {
    std::vector<float> positions;
    std::vector<uint32_t> triangles;
};

struct Ray {
    Vec origin, direction;
};

[[noreturn]] static void fail(const std::string& message) {
    std::fprintf(stderr, "%s\n", message.c_str());
    std::exit(2);
}

static size_t width(const std::string& type) {
    if (type == "double" || type == "float64") return 8;
    if (type == "float" || type == "float32" || type == "int" || type == "uint" || type == "int32" || type == "uint32") return 4;
    if (type == "short" || type == "ushort" || type == "int16" || type == "uint16") return 2;
    if (type == "char" || type == "uchar" || type == "int8" || type == "uint8") return 1;
    fail("unknown PLY type " + type);
}

static Mesh read_ply(const char* path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) fail(std::string(path) + ": cannot be opened");
    std::string line, element;
    size_t vertices = 0, faces = 0, stride = 0, coordinate = 0;
    bool binary = false;
    while (std::getline(file, line) && line.rfind("end_header", 0) != 0) {
        std::istringstream words(line);
        std::string key, a, b;
        words >> key >> a >> b;
        if (key == "format") binary = a == "binary_little_endian";
        if (key == "element") {
            element = a;
            (a == "vertex" ? vertices : faces) = std::stoul(b);
        }
        if (key == "property" && element == "vertex") {
            if (stride == 0) coordinate = width(a);
            stride += width(a);
        }
    }
    if (!binary || vertices == 0 || faces == 0) fail(std::string(path) + ": not a binary little-endian PLY with triangles");
    Mesh mesh;
    std::vector<char> row(stride);
    for (size_t i = 0; i < vertices && file.read(row.data(), static_cast<std::streamsize>(stride)); ++i) {
        for (size_t axis = 0; axis < 3; ++axis) {
            double wide;
            float narrow;
            if (coordinate == 8) {
                std::memcpy(&wide, &row[8 * axis], 8);
                narrow = static_cast<float>(wide);
            } else {
                std::memcpy(&narrow, &row[4 * axis], 4);
            }
            mesh.positions.push_back(narrow);
        }
    }
    for (size_t i = 0; i < faces; ++i) {
        uint8_t corners = 0;
        uint32_t index[3];
        file.read(reinterpret_cast<char*>(&corners), 1);
        file.read(reinterpret_cast<char*>(index), sizeof index);
        if (!file || corners != 3) fail(std::string(path) + ": cut off, or a face is no triangle");
        for (uint32_t k : index) {
            if (k >= vertices) fail(std::string(path) + ": a face uses a vertex that is not there");
            mesh.triangles.push_back(k);
        }
    }
    return mesh;
}

static double uniform(uint32_t h) {
    h ^= h >> 16;
    h *= 0x7feb352dU;
    h ^= h >> 15;
    h *= 0x846ca68bU;
    h ^= h >> 16;
    return (h >> 8) * 0x1p-24;
}

static RTCRayHit prepared(const Ray& ray) {
    RTCRayHit hit{};
    hit.ray.org_x = static_cast<float>(ray.origin.x);
    hit.ray.org_y = static_cast<float>(ray.origin.y);
    hit.ray.org_z = static_cast<float>(ray.origin.z);
    hit.ray.dir_x = static_cast<float>(ray.direction.x);
    hit.ray.dir_y = static_cast<float>(ray.direction.y);
    hit.ray.dir_z = static_cast<float>(ray.direction.z);
    hit.ray.tfar = std::numeric_limits<float>::infinity();
    hit.ray.mask = ~0U;
    hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    return hit;
}

static std::vector<Ray> primary_rays(Vec lo, Vec hi, int size) {
    Vec centre = 0.5 * (lo + hi);
    double diag = std::sqrt(dot(hi - lo, hi - lo));
    Vec eye = centre + 1.6 * diag * normalise({0, 0.35, 1});
    Vec f = normalise(centre - eye), r = normalise(cross(f, {0, 1, 0})), u = cross(r, f);
    double t = std::tan(20.0 * 3.14159265358979323846 / 180.0);
    std::vector<Ray> rays;
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
            double a = t * (2 * (x + 0.5) / size - 1), b = t * (1 - 2 * (y + 0.5) / size);
            rays.push_back({eye, normalise(f + a * r + b * u)});
        }
    return rays;
}

static std::vector<Ray> random_rays(RTCScene scene, const std::vector<Ray>& primary, double diag) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    std::vector<Ray> rays;
    for (uint32_t i = 0; i < primary.size(); ++i) {
        RTCRayHit hit = prepared(primary[i]);
        rtcIntersect1(scene, &context, &hit);
        if (hit.hit.geomID == RTC_INVALID_GEOMETRY_ID) continue;
        Vec n = normalise({hit.hit.Ng_x, hit.hit.Ng_y, hit.hit.Ng_z});
        if (dot(n, primary[i].direction) > 0) n = -1.0 * n;
        Vec m = {std::fabs(n.x), std::fabs(n.y), std::fabs(n.z)};
        Vec e = m.x <= m.y && m.x <= m.z ? Vec{1, 0, 0} : m.y <= m.z ? Vec{0, 1, 0} : Vec{0, 0, 1};
        Vec s = normalise(cross(n, e)), t = cross(n, s);
        double phi = 2 * 3.14159265358979323846 * uniform(2 * i), b = uniform(2 * i + 1), q = std::sqrt(b);
        Vec d = q * std::cos(phi) * s + q * std::sin(phi) * t + std::sqrt(1 - b) * n;
        rays.push_back({primary[i].origin + hit.ray.tfar * primary[i].direction + 1e-4 * diag * n, d});
    }
    return rays;
}

// Prints hits, the sum of distances (to compare programs by) and the median speed.
static void report(const char* name, RTCScene scene, const std::vector<Ray>& rays, int runs) {
    std::vector<RTCRayHit> ready;
    for (const Ray& ray : rays) ready.push_back(prepared(ray));
    std::vector<double> speed;
    size_t hits = 0;
    double distance = 0;
    for (int run = 0; run < runs; ++run) {
        std::vector<RTCRayHit> work = ready;
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        auto start = std::chrono::steady_clock::now();
        for (RTCRayHit& ray : work) rtcIntersect1(scene, &context, &ray);
        std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
        speed.push_back(1e-6 * static_cast<double>(work.size()) / seconds.count());
        hits = 0;
        distance = 0;
        for (const RTCRayHit& ray : work)
            if (ray.hit.geomID != RTC_INVALID_GEOMETRY_ID) {
                ++hits;
                distance += ray.ray.tfar;
            }
    }
    std::sort(speed.begin(), speed.end());
    std::printf(" \"%s\": {\"rays\": %zu, \"hits\": %zu, \"sum_of_distances\": %.9g, ", name, rays.size(), hits, distance);
    std::printf("\"mrays_per_second\": %.4f, \"slowest\": %.4f, \"fastest\": %.4f}", speed[speed.size() / 2], speed.front(), speed.back());
}

int main(int argc, char** argv) {
    if (argc < 2) fail("usage: embree_rays MESH.ply [RUNS]");
    int runs = argc > 2 ? std::max(1, std::atoi(argv[2])) : 5;
    Mesh mesh = read_ply(argv[1]);
    size_t vertices = mesh.positions.size() / 3, triangles = mesh.triangles.size() / 3;

    RTCDevice device = rtcNewDevice("threads=1");
    RTCScene scene = rtcNewScene(device);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    void* points = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, vertices);
    std::memcpy(points, mesh.positions.data(), 12 * vertices);
    void* corners = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, triangles);
    std::memcpy(corners, mesh.triangles.data(), 12 * triangles);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    auto start = std::chrono::steady_clock::now();
    rtcCommitScene(scene);
    std::chrono::duration<double> build = std::chrono::steady_clock::now() - start;

    Vec lo = {1e300, 1e300, 1e300}, hi = {-1e300, -1e300, -1e300};
    for (size_t i = 0; i < vertices; ++i) {
        const float* p = &mesh.positions[3 * i];
        lo = {std::min(lo.x, double(p[0])), std::min(lo.y, double(p[1])), std::min(lo.z, double(p[2]))};
        hi = {std::max(hi.x, double(p[0])), std::max(hi.y, double(p[1])), std::max(hi.z, double(p[2]))};
    }
    std::vector<Ray> primary = primary_rays(lo, hi, 1024);
    std::vector<Ray> random = random_rays(scene, primary, std::sqrt(dot(hi - lo, hi - lo)));
    std::printf("{\"embree\": \"%s\", \"vertices\": %zu, \"triangles\": %zu, \"build_seconds\": %.4f,\n", RTC_VERSION_STRING, vertices, triangles, build.count());
    report("primary", scene, primary, runs);
    std::printf(",\n");
    report("random", scene, random, runs);
    std::printf("\n}\n");
    rtcReleaseGeometry(geometry);
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
    return 0;
}
