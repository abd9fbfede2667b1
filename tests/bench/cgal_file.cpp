// The least that a user of CGAL has to write for what `incode run A.npy -o
// B.npy` does: points out of a .npy, tetrahedra of their rows into another.
//
//     cgal_file POINTS.npy TETRAHEDRA.npy    {"tetrahedra": 134000, ...}
#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>

#include <array>
#include <cstdint>
#include <fstream>
#include <iostream>
#include <string>
#include <utility>
#include <vector>

#include "peer.hpp"

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Base = CGAL::Triangulation_vertex_base_with_info_3<uint32_t, Kernel>;
using Structure = CGAL::Triangulation_data_structure_3<
    Base, CGAL::Delaunay_triangulation_cell_base_3<Kernel>>;
using Delaunay = CGAL::Delaunay_triangulation_3<Kernel, Structure>;

static bool write_npy(const char *path,
                      const std::vector<std::array<uint32_t, 4>> &rows) {
    std::ofstream out(path, std::ios::binary);
    std::string header =
        "{'descr': '<u4', 'fortran_order': False, 'shape': (" +
        std::to_string(rows.size()) + ", 4), }";
    header.resize(117, ' ');
    out << std::string("\x93NUMPY\x01\x00\x76\x00", 10) << header << '\n';
    out.write(reinterpret_cast<const char *>(rows.data()),
              static_cast<std::streamsize>(rows.size() * sizeof rows[0]));
    return out.flush().good();
}

int main(int argc, char **argv) {
    if (argc != 3) {
        std::cerr << "usage: cgal_file POINTS.npy TETRAHEDRA.npy\n";
        return 2;
    }
    peer::Watch watch;
    const std::vector<double> numbers = peer::read_npy(argv[1]);
    std::vector<std::pair<Kernel::Point_3, uint32_t>> points;
    points.reserve(numbers.size() / 3);
    for (std::size_t i = 0; i + 2 < numbers.size(); i += 3) {
        points.emplace_back(
            Kernel::Point_3(numbers[i], numbers[i + 1], numbers[i + 2]),
            static_cast<uint32_t>(i / 3));
    }
    const Delaunay t(points.begin(), points.end());
    std::vector<std::array<uint32_t, 4>> rows;
    rows.reserve(t.number_of_finite_cells());
    for (auto cell : t.finite_cell_handles()) {
        rows.push_back({cell->vertex(0)->info(), cell->vertex(1)->info(),
                        cell->vertex(2)->info(), cell->vertex(3)->info()});
    }
    if (!write_npy(argv[2], rows)) {
        std::cerr << argv[2] << ": cannot be written\n";
        return 3;
    }
    watch.stop();
    watch.print(rows.size(), "");
    return 0;
}
