// What the peers of `incode bench peers` have in common: points out of a .npy,
// and a line of JSON about one call with the points in memory.
#ifndef PEER_HPP
#define PEER_HPP

#include <time.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

namespace peer {

// x, y, z of each point, one behind the other.
inline std::vector<double> read_npy(const char *path) {
    std::ifstream in(path, std::ios::binary);
    char magic[8];
    uint16_t header = 0;
    in.read(magic, 8);
    in.read(reinterpret_cast<char *>(&header), 2);
    in.seekg(0, std::ios::end);
    const std::streamoff end = in.tellg(), begin = 10 + header;
    if (!in || end < begin) {
        return {};
    }
    std::vector<double> numbers(static_cast<std::size_t>(end - begin) / 8);
    in.seekg(begin);
    in.read(reinterpret_cast<char *>(numbers.data()), end - begin);
    return numbers;
}

inline double seconds(clockid_t clock) {
    struct timespec now;
    clock_gettime(clock, &now);
    return static_cast<double>(now.tv_sec) +
           1e-9 * static_cast<double>(now.tv_nsec);
}

// From its making on: processor time of all threads, and the clock's.
class Watch {
  public:
    void stop() {
        cpu_ += seconds(CLOCK_PROCESS_CPUTIME_ID);
        wall_ += seconds(CLOCK_MONOTONIC);
    }
    void print(std::size_t tetrahedra, const std::string &digest,
               const char *kind = "sha256") const {
        std::printf("{\"tetrahedra\": %zu, \"cpu_s\": %.6f, \"wall_s\": %.6f%s",
                    tetrahedra, cpu_, wall_, digest.empty() ? "" : ", ");
        if (!digest.empty()) {
            std::printf("\"digest\": \"%s:%s\"", kind, digest.c_str());
        }
        std::printf("}\n");
    }

  private:
    double cpu_ = -seconds(CLOCK_PROCESS_CPUTIME_ID);
    double wall_ = -seconds(CLOCK_MONOTONIC);
};

} // namespace peer

#endif
