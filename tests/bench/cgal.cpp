// CGAL's Delaunay triangulation of the same points, for `make bench`: the time
// of one call with the points in memory, its spatial sort included.
//
//     cgal POINTS.npy             {"tetrahedra": 134000, "time_s": 0.07}
//     cgal POINTS.npy OUT.ele     also writes the tetrahedra; rows from 0
//
// Compiled with -frounding-math, as CGAL demands of gcc, so that its interval
// filters hold; contraction is left as gcc has it.
#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <map>
#include <string>
#include <utility>
#include <vector>

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Plain = CGAL::Delaunay_triangulation_3<Kernel>;
using Vertex = CGAL::Triangulation_vertex_base_with_info_3<uint32_t, Kernel>;
using Numbered = CGAL::Delaunay_triangulation_3<
    Kernel, CGAL::Triangulation_data_structure_3<
                Vertex, CGAL::Delaunay_triangulation_cell_base_3<Kernel>>>;

static std::vector<Point> read_npy(const char *path) {
    std::ifstream in(path, std::ios::binary);
    char magic[8];
    uint16_t header = 0;
    in.read(magic, 8);
    in.read(reinterpret_cast<char *>(&header), 2);
    in.seekg(10 + header);
    std::vector<Point> points;
    double p[3];
    while (in.read(reinterpret_cast<char *>(p), sizeof p)) {
        points.emplace_back(p[0], p[1], p[2]);
    }
    return points;
}

// A duplicate stands for its lowest row.
static void write_ele(const std::vector<Point> &points, const char *path) {
    std::map<Point, uint32_t> rows;
    for (uint32_t i = 0; i < points.size(); i++) {
        rows.emplace(points[i], i);
    }
    std::vector<std::pair<Point, uint32_t>> numbered(rows.begin(), rows.end());
    Numbered t(numbered.begin(), numbered.end());
    std::ofstream out(path);
    out << t.number_of_finite_cells() << " 4 0\n";
    uint64_t i = 0;
    for (auto cell : t.finite_cell_handles()) {
        out << i++;
        for (int k = 0; k < 4; k++) {
            out << ' ' << cell->vertex(k)->info();
        }
        out << '\n';
    }
}

int main(int argc, char **argv) {
    if (argc < 2) {
        std::cerr << "usage: cgal POINTS.npy [OUT.ele]\n";
        return 2;
    }
    const std::vector<Point> points = read_npy(argv[1]);
    const auto start = std::chrono::steady_clock::now();
    const Plain t(points.begin(), points.end());
    const std::chrono::duration<double> time =
        std::chrono::steady_clock::now() - start;
    std::printf("{\"tetrahedra\": %zu, \"time_s\": %.6f}\n",
                static_cast<std::size_t>(t.number_of_finite_cells()),
                time.count());
    if (argc > 2) {
        write_ele(points, argv[2]);
    }
    return 0;
}
