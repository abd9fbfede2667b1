// CGAL's Delaunay triangulation, its spatial sort included.
//
//     cgal POINTS.npy           {"tetrahedra": 134000, "cpu_s": 0.07, ...}
//     cgal POINTS.npy digest    also the digest of the tetrahedra
//
// Compiled with -frounding-math, as CGAL demands of gcc, so that its interval
// filters hold; contraction is left as gcc has it.
#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <nettle/sha2.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <iostream>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "peer.hpp"

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Delaunay = CGAL::Delaunay_triangulation_3<Kernel>;

// SHA-256 of the rows in ascending order, a duplicate standing for its lowest.
static std::string digest(const std::vector<Point> &points,
                          const Delaunay &t) {
    std::map<Point, uint32_t> lowest;
    for (uint32_t i = 0; i < points.size(); i++) {
        lowest.emplace(points[i], i);
    }
    std::unordered_map<const void *, uint32_t> row;
    for (auto vertex : t.finite_vertex_handles()) {
        row[&*vertex] = lowest[vertex->point()];
    }
    std::vector<std::array<uint32_t, 4>> rows;
    for (auto cell : t.finite_cell_handles()) {
        std::array<uint32_t, 4> v;
        for (int k = 0; k < 4; k++) {
            v[static_cast<std::size_t>(k)] = row[&*cell->vertex(k)];
        }
        std::sort(v.begin(), v.end());
        rows.push_back(v);
    }
    std::sort(rows.begin(), rows.end());
    struct sha256_ctx context;
    uint8_t sum[SHA256_DIGEST_SIZE];
    sha256_init(&context);
    sha256_update(&context, rows.size() * sizeof rows[0],
                  reinterpret_cast<const uint8_t *>(rows.data()));
    sha256_digest(&context, sizeof sum, sum);
    std::string text;
    for (const uint8_t byte : sum) {
        text += "0123456789abcdef"[byte >> 4];
        text += "0123456789abcdef"[byte & 15];
    }
    return text;
}

int main(int argc, char **argv) {
    if (argc < 2) {
        std::cerr << "usage: cgal POINTS.npy [digest]\n";
        return 2;
    }
    const std::vector<double> numbers = peer::read_npy(argv[1]);
    std::vector<Point> points;
    for (std::size_t i = 0; i + 2 < numbers.size(); i += 3) {
        points.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
    }
    peer::Watch watch;
    const Delaunay t(points.begin(), points.end());
    watch.stop();
    watch.print(t.number_of_finite_cells(), argc > 2 ? digest(points, t) : "");
    return 0;
}
