// Point location by CGAL: queries in the order of its spatial sort, each walk
// from where the one before has ended.
//
//     cgal_locate POINTS.npy QUERIES.npy
//
// prints what tests/bench/locate.c prints.
#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Spatial_sort_traits_adapter_3.h>
#include <CGAL/property_map.h>
#include <CGAL/spatial_sort.h>

#include <cstring>
#include <iostream>
#include <numeric>
#include <vector>

#include "peer.hpp"

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Delaunay = CGAL::Delaunay_triangulation_3<Kernel>;
using Order = CGAL::Spatial_sort_traits_adapter_3<
    Kernel, CGAL::Pointer_property_map<Point>::type>;

static std::vector<Point> read(const char *path) {
    const std::vector<double> numbers = peer::read_npy(path);
    std::vector<Point> points;
    for (std::size_t i = 0; i + 2 < numbers.size(); i += 3) {
        points.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
    }
    return points;
}

// Of the coordinates of a tetrahedron's vertices, in any order.
static uint64_t mix(const Delaunay::Cell_handle cell) {
    uint64_t sum = 0;
    for (int i = 0; i < 4; i++) {
        const Point &p = cell->vertex(i)->point();
        const double xyz[3] = {p.x(), p.y(), p.z()};
        uint64_t bits[3];
        std::memcpy(bits, xyz, sizeof bits);
        const uint64_t x = bits[0] + 3 * bits[1] + 5 * bits[2];
        sum += (x ^ x >> 29) * UINT64_C(0x9e3779b97f4a7c15);
    }
    return sum;
}

int main(int argc, char **argv) {
    if (argc != 3) {
        std::cerr << "usage: cgal_locate POINTS.npy QUERIES.npy\n";
        return 2;
    }
    const std::vector<Point> points = read(argv[1]);
    std::vector<Point> queries = read(argv[2]);
    const Delaunay t(points.begin(), points.end());
    std::vector<Delaunay::Cell_handle> found(queries.size());
    peer::Watch watch;
    std::vector<std::size_t> order(queries.size());
    std::iota(order.begin(), order.end(), 0);
    CGAL::spatial_sort(order.begin(), order.end(),
                       Order(CGAL::make_property_map(queries)));
    Delaunay::Cell_handle last;
    for (const std::size_t i : order) {
        found[i] = last = t.locate(queries[i], last);
    }
    watch.stop();
    std::size_t inside = 0;
    uint64_t sum = 0;
    for (std::size_t i = 0; i < found.size(); i++) {
        if (!t.is_infinite(found[i])) {
            inside++;
            sum += (i + 1) * mix(found[i]);
        }
    }
    char text[32];
    std::snprintf(text, sizeof text, "%016llx",
                  static_cast<unsigned long long>(sum));
    watch.print(inside, text, "sum");
    return 0;
}
