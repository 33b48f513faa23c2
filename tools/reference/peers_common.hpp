// What the runners of other curvature libraries share: mesh in, timing, result out.
//
//   RUNNER MESH.obj RESULT.f64 RUNS SETTING
//
// MESH.obj has `v x y z` and triangles `f a b c` only. RESULT.f64 gets five doubles a vertex: kappa_max, kappa_min (unit sphere,
// outward: +1) and the direction of kappa_max; NaN where there is no answer. Standard output gets one line of JSON: seconds
// of every run, and the resident memory that the estimate took at most beyond the loaded mesh. One thread.

#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <limits>
#include <string>
#include <vector>

using Point = std::array<double, 3>;
using Triangle = std::array<int, 3>;

struct Input {
    std::vector<Point> points;
    std::vector<Triangle> triangles;
};

// kappa_max, kappa_min, direction of kappa_max.
using Answer = std::array<double, 5>;

inline Answer no_answer() {
    Answer none;
    none.fill(std::numeric_limits<double>::quiet_NaN());
    return none;
}

inline Point minus(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

inline double length(const Point& a) { return std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]); }

inline Input read_obj(const char* path) {
    FILE* file = std::fopen(path, "r");
    if (!file) std::perror(path), std::exit(2);
    Input mesh;
    char line[512];
    while (std::fgets(line, sizeof line, file)) {
        Point p;
        Triangle t;
        if (std::sscanf(line, "v %lf %lf %lf", &p[0], &p[1], &p[2]) == 3) mesh.points.push_back(p);
        if (std::sscanf(line, "f %d %d %d", &t[0], &t[1], &t[2]) == 3) mesh.triangles.push_back({t[0] - 1, t[1] - 1, t[2] - 1});
    }
    std::fclose(file);
    return mesh;
}

inline double mean_edge(const Input& mesh) {
    double sum = 0;
    for (const auto& t : mesh.triangles)
        for (int i = 0; i < 3; ++i) sum += length(minus(mesh.points[t[i]], mesh.points[t[(i + 1) % 3]]));
    return sum / (3.0 * mesh.triangles.size());
}

// Area-weighted unit normals.
inline std::vector<Point> vertex_normals(const Input& mesh) {
    std::vector<Point> normals(mesh.points.size(), Point{0, 0, 0});
    for (const auto& t : mesh.triangles) {
        const Point a = minus(mesh.points[t[1]], mesh.points[t[0]]), b = minus(mesh.points[t[2]], mesh.points[t[0]]);
        const Point n = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
        for (int v : t)
            for (int k = 0; k < 3; ++k) normals[v][k] += n[k];
    }
    for (auto& n : normals) {
        const double size = length(n);
        for (double& x : n) x /= size > 0 ? size : 1;
    }
    return normals;
}

// Neighbours over edges as rows of one array, each once.
struct Rings {
    std::vector<int> start, next, stamp, members;
    int round = 0;

    explicit Rings(const Input& mesh) : start(mesh.points.size() + 1), stamp(mesh.points.size(), -1) {
        std::vector<std::vector<int>> rows(mesh.points.size());
        for (const auto& t : mesh.triangles)
            for (int i = 0; i < 3; ++i) rows[t[i]].push_back(t[(i + 1) % 3]), rows[t[i]].push_back(t[(i + 2) % 3]);
        for (std::size_t v = 0; v < rows.size(); ++v) {
            auto& row = rows[v];
            std::sort(row.begin(), row.end());
            row.erase(std::unique(row.begin(), row.end()), row.end());
            next.insert(next.end(), row.begin(), row.end());
            start[v + 1] = static_cast<int>(next.size());
        }
    }

    // The vertex first, then everything within `rings` edges, and further rings until there are `least`.
    const std::vector<int>& around(int vertex, int rings, std::size_t least) {
        ++round;
        members.assign(1, vertex);
        stamp[vertex] = round;
        std::size_t from = 0;
        for (int ring = 0; ring < rings || members.size() < least; ++ring) {
            const std::size_t to = members.size();
            for (; from < to; ++from)
                for (int i = start[members[from]]; i < start[members[from] + 1]; ++i)
                    if (stamp[next[i]] != round) stamp[next[i]] = round, members.push_back(next[i]);
            if (members.size() == to) break;
        }
        return members;
    }
};

// The number after `name` in the setting: "aso5" with "aso" is 5; below zero if there is none.
inline double number_after(const std::string& setting, const std::string& name) {
    if (setting.rfind(name, 0) != 0 || setting.size() == name.size()) return -1;
    return std::stod(setting.substr(name.size()));
}

inline long status_kilobytes(const char* field) {
    std::ifstream status("/proc/self/status");
    const std::string wanted = std::string(field) + ":";
    for (std::string line; std::getline(status, line);)
        if (line.rfind(wanted, 0) == 0) return std::stol(line.substr(wanted.size()));
    return 0;
}

using Estimate = std::function<std::vector<Answer>()>;

// Runs, times and writes. `prepare` does what is not to be timed, such as building the library's own mesh.
inline int run(int argc, char** argv, const std::function<Estimate(const Input&, const std::string&)>& prepare) {
    if (argc != 5) {
        std::fprintf(stderr, "usage: %s MESH.obj RESULT.f64 RUNS SETTING\n", argv[0]);
        return 2;
    }
    const Input mesh = read_obj(argv[1]);
    const Estimate estimate = prepare(mesh, argv[4]);
    std::ofstream("/proc/self/clear_refs") << 5;  // the peak starts here
    const long before = status_kilobytes("VmRSS");
    long peak = 0;
    std::vector<Answer> answers;
    std::string seconds;
    for (int i = 0; i < std::max(1, std::atoi(argv[3])); ++i) {
        const auto start = std::chrono::steady_clock::now();
        answers = estimate();
        const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
        if (i == 0) peak = status_kilobytes("VmHWM");
        seconds += (i ? ", " : "") + std::to_string(took.count());
    }
    std::ofstream out(argv[2], std::ios::binary);
    out.write(reinterpret_cast<const char*>(answers.data()), static_cast<std::streamsize>(answers.size() * sizeof(Answer)));
    std::printf("{\"seconds\": [%s], \"peak_bytes\": %ld}\n", seconds.c_str(), 1024 * std::max(0L, peak - before));
    return out ? 0 : 2;
}
