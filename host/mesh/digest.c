/* The digest alone needs a library of hashes, which the library of
 * triangulations does without. */
#include <nettle/sha2.h>
#include <stdio.h>
#include <string.h>

#include "host/base/parallel.h"
#include "tetrahedra.h"

void host_digest(const struct host_tetrahedra *tets,
                 struct host_digest *digest) {
    enum { ROWS = 2048 };
    struct sha256_ctx sha;
    sha256_init(&sha);
    uint32_t row[ROWS][4];
    for (uint64_t done = 0; done < tets->count;) {
        uint64_t n = tets->count - done < ROWS ? tets->count - done : ROWS;
        memcpy(row, tets->v + done, n * sizeof *row);
        host_call_trim(n * sizeof *row);
        for (uint64_t i = 0; i < n; i++) {
            uint32_t c = row[i][2], d = row[i][3];
            row[i][2] = c < d ? c : d;
            row[i][3] = c < d ? d : c;
        }
        sha256_update(&sha, n * sizeof *row, (const uint8_t *)row);
        done += n;
    }
    uint8_t sum[SHA256_DIGEST_SIZE];
    sha256_digest(&sha, sizeof sum, sum);
    char *out = digest->text + sprintf(digest->text, "sha256:");
    for (size_t i = 0; i < sizeof sum; i++)
        out += sprintf(out, "%02x", sum[i]);
}
