// HXT's Delaunay triangulation, the one of Gmsh: Marot, Pellerin, Remacle, "One
// machine, one minute, three billion tetrahedra" (2019).
//
//     hxt POINTS.npy            {"tetrahedra": 134000, "cpu_s": 0.06, ...}
//     hxt POINTS.npy 2          the same on two threads
//
// Debian's libgmsh exports HXT, but has no header of it.  The declarations here
// are those of Gmsh 4.8, and of 4.9 to 4.15, which have one option more.
#include <gmsh.h>
#include <omp.h>

#include <cstdlib>
#include <iostream>
#include <vector>

#include "peer.hpp"

#if GMSH_API_VERSION_MAJOR != 4 || GMSH_API_VERSION_MINOR < 8 ||               \
    GMSH_API_VERSION_MINOR > 15
#error "what HXT's structures are in this version of Gmsh is not known"
#endif

struct Mesh { // its beginning: the library makes it
    double *coordinates; // x, y, z and one more, of each vertex; free frees it
    uint32_t vertices, vertices_allocated;
    uint32_t *node; // 4 of each tetrahedron; the infinite vertex is the fourth
    uint64_t *neighbour;
    uint32_t *color;
    uint16_t *flag;
    uint64_t tetrahedra, tetrahedra_allocated;
};

struct Options {
    void *box, *sizes;
    uint32_t vertices_in_mesh, first;
    double partitionability;
    int perfect; // no edge or facet is constrained
#if GMSH_API_VERSION_MINOR > 8
    int outer;
#endif
    int verbosity, reproducible, threads;
};

extern "C" {
int hxtMeshCreate(Mesh **mesh);
int hxtDelaunay(Mesh *mesh, Options *options);
}

int main(int argc, char **argv) {
    if (argc < 2) {
        std::cerr << "usage: hxt POINTS.npy [THREADS]\n";
        return 2;
    }
    const std::vector<double> numbers = peer::read_npy(argv[1]);
    const std::size_t count = numbers.size() / 3;
    Options options = {};
    Mesh *mesh = nullptr;
    auto *at = static_cast<double *>(std::malloc(4 * count * sizeof(double)));
    if (at == nullptr || hxtMeshCreate(&mesh) < 0) {
        return 1;
    }
    for (std::size_t i = 0; i < 4 * count; i++) {
        at[i] = i % 4 == 3 ? 0 : numbers[i / 4 * 3 + i % 4];
    }
    mesh->coordinates = at;
    mesh->vertices = mesh->vertices_allocated = static_cast<uint32_t>(count);
    options.perfect = 1;
    options.threads = argc > 2 ? std::atoi(argv[2]) : 1;
    omp_set_num_threads(options.threads); // of its sorting
    peer::Watch watch;
    const int status = hxtDelaunay(mesh, &options);
    watch.stop();
    if (status < 0) {
        return 1;
    }
    std::size_t tetrahedra = 0;
    for (uint64_t i = 0; i < mesh->tetrahedra; i++) {
        tetrahedra += mesh->node[4 * i + 3] == UINT32_MAX ? 0 : 1;
    }
    watch.print(tetrahedra, "");
    return 0;
}
