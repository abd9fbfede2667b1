// TetGen's Delaunay triangulation of the points: no constraint, no refinement.
//
//     tetgen POINTS.npy         {"tetrahedra": 134000, "cpu_s": 0.1, ...}
#define TETLIBRARY // the calls that the library has
#include <tetgen.h>

#include <iostream>
#include <vector>

#include "peer.hpp"

int main(int argc, char **argv) {
    if (argc < 2) {
        std::cerr << "usage: tetgen POINTS.npy\n";
        return 2;
    }
    std::vector<double> numbers = peer::read_npy(argv[1]);
    tetgenio in, out;
    char quiet[] = "QNF";
    in.numberofpoints = static_cast<int>(numbers.size() / 3);
    in.pointlist = numbers.data();
    peer::Watch watch;
    try {
        tetrahedralize(quiet, &in, &out);
    } catch (int fault) {
        std::cerr << "tetgen: it gave up with " << fault << "\n";
        return 1;
    }
    watch.stop();
    in.pointlist = nullptr; // it is the vector's
    watch.print(static_cast<std::size_t>(out.numberoftetrahedra), "");
    return 0;
}
