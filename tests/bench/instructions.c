/* A plugin of QEMU that counts what an emulated processor executes: how often
 * each translated block begins, in a file that can be read at any moment.  It
 * is written against QEMU's documented interface (docs/devel/tcg-plugins),
 * whose header distributions do not ship.
 *
 *     qemu-system-arm ... -plugin BUILD/peers/instructions.so,folder=FOLDER
 *
 * The file is FOLDER/PID.count: struct count, one behind the other, up to one
 * that is 0.
 */
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

struct qemu_plugin_tb;
struct qemu_info;
typedef uint64_t qemu_plugin_id_t;
typedef void translated(qemu_plugin_id_t id, struct qemu_plugin_tb *block);
typedef void executed(unsigned processor, void *data);
enum { NO_REGISTERS = 0 };

void qemu_plugin_register_vcpu_tb_trans_cb(qemu_plugin_id_t id, translated *f);
void qemu_plugin_register_vcpu_tb_exec_cb(struct qemu_plugin_tb *block,
                                          executed *f, int flags, void *data);
size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb *block);
uint64_t qemu_plugin_tb_vaddr(const struct qemu_plugin_tb *block);

int qemu_plugin_version = 1;
int qemu_plugin_install(qemu_plugin_id_t id, const struct qemu_info *info,
                        int argc, char **argv);

struct count {
    uint64_t address, instructions, times;
};
enum { COUNTS_MAX = 1 << 20 };

static struct count *counts;
static unsigned used;

static void once_more(unsigned processor, void *data) {
    struct count *count = data;
    (void)processor;
    count->times++;
}

static void new_block(qemu_plugin_id_t id, struct qemu_plugin_tb *block) {
    (void)id;
    if (used < COUNTS_MAX) {
        struct count *count = &counts[used++];
        count->address = qemu_plugin_tb_vaddr(block);
        count->instructions = qemu_plugin_tb_n_insns(block);
        qemu_plugin_register_vcpu_tb_exec_cb(block, once_more, NO_REGISTERS,
                                             count);
    }
}

int qemu_plugin_install(qemu_plugin_id_t id, const struct qemu_info *info,
                        int argc, char **argv) {
    static const char folder[] = "folder=";
    char path[4096];
    (void)info;
    if (argc != 1 || strncmp(argv[0], folder, sizeof folder - 1) != 0)
        return -1;
    snprintf(path, sizeof path, "%s/%ld.count", argv[0] + sizeof folder - 1,
             (long)getpid());
    int fd = open(path, O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    if (fd < 0 || ftruncate(fd, COUNTS_MAX * sizeof *counts) != 0)
        return -1;
    counts = mmap(NULL, COUNTS_MAX * sizeof *counts, PROT_READ | PROT_WRITE,
                  MAP_SHARED, fd, 0);
    close(fd);
    if (counts == MAP_FAILED)
        return -1;
    qemu_plugin_register_vcpu_tb_trans_cb(id, new_block);
    return 0;
}
