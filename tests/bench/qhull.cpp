// Qhull's Delaunay triangulation, as the hull of the points lifted, facets that
// are no tetrahedra cut into some.
//
//     qhull POINTS.npy          {"tetrahedra": 134000, "cpu_s": 0.6, ...}
#include <libqhull_r/qhull_ra.h>

#include <iostream>
#include <vector>

#include "peer.hpp"

int main(int argc, char **argv) {
    if (argc < 2) {
        std::cerr << "usage: qhull POINTS.npy\n";
        return 2;
    }
    std::vector<double> numbers = peer::read_npy(argv[1]);
    char command[] = "qhull d Qt Qbb Q12";
    qhT data, *qh = &data;
    qh_zero(qh, stderr);
    peer::Watch watch;
    const int fault =
        qh_new_qhull(qh, 3, static_cast<int>(numbers.size() / 3),
                     numbers.data(), False, command, nullptr, stderr);
    watch.stop();
    if (fault != 0) {
        return 1;
    }
    std::size_t tetrahedra = 0;
    facetT *facet;
    FORALLfacets {
        tetrahedra += facet->upperdelaunay ? 0 : 1;
    }
    watch.print(tetrahedra, "");
    return 0;
}
