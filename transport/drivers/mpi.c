#include "mpi.h"

#include <linux/futex.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

/* --- the place ------------------------------------------------------------ */

/* Where ranks share processors, Open MPI gives the processor away in each test
 * that finds nothing: right for those who wait by testing (as it does itself
 * at start and end), but a rank here computes between its tests and sleeps when
 * it has nothing to do.  Its library has this switch, and no public name for
 * it; another MPI has neither. */
bool opal_progress_set_yield_when_idle(bool yield) __attribute__((weak));

/* The words of the ranks that share this machine's memory. */
static void share_words(struct mpi_place *place) {
    MPI_Group all, local;
    int count = 0, rank = 0;
    void *own = NULL;
    if (getenv("INCODE_MPI_APART") != NULL) { /* as if on many, for tests */
        MPI_Comm_split(place->comm, place->rank, 0, &place->local);
    } else {
        MPI_Comm_split_type(place->comm, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL,
                            &place->local);
    }
    MPI_Comm_size(place->local, &count);
    MPI_Comm_rank(place->local, &rank);
    /* A cache line each. */
    MPI_Win_allocate_shared(64, 1, MPI_INFO_NULL, place->local, (void *)&own,
                            &place->window);
    memset(own, 0, 64);
    MPI_Comm_group(place->comm, &all);
    MPI_Comm_group(place->local, &local);
    for (int i = 0; i < count; i++) {
        MPI_Aint size;
        int unit, there = 0;
        void *word = NULL;
        MPI_Win_shared_query(place->window, i, &size, &unit, (void *)&word);
        MPI_Group_translate_ranks(local, 1, &i, all, &there);
        place->bell[there] = word;
    }
    count = (int)getpid();
    MPI_Allgather(&count, 1, MPI_INT, place->process, 1, MPI_INT, place->comm);
    for (int i = 0; i < place->ranks; i++)
        place->process[i] = place->bell[i] == NULL ? 0 : place->process[i];
    MPI_Group_free(&all);
    MPI_Group_free(&local);
    MPI_Barrier(place->local); /* nobody rings before the words are zero */
}

int mpi_place_open(struct mpi_place *place) {
    memset(place, 0, sizeof *place);
    MPI_Comm_dup(MPI_COMM_WORLD, &place->comm);
    MPI_Comm_rank(place->comm, &place->rank);
    MPI_Comm_size(place->comm, &place->ranks);
    if (place->ranks > MPI_RANKS_MAX) {
        MPI_Comm_free(&place->comm);
        return -1;
    }
    share_words(place);
    place->yields = opal_progress_set_yield_when_idle != NULL &&
                    opal_progress_set_yield_when_idle(false);
    return 0;
}

void mpi_place_close(struct mpi_place *place) {
    if (place->yields)
        (void)opal_progress_set_yield_when_idle(true);
    MPI_Win_free(&place->window);
    MPI_Comm_free(&place->local);
    MPI_Comm_free(&place->comm);
}

/* --- sleep ---------------------------------------------------------------- */

static uint64_t now_us(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000 + (uint64_t)now.tv_nsec / 1000;
}

void mpi_ring(struct mpi_place *place, int rank) {
    _Atomic uint32_t *bell = place->bell[rank];
    if (bell == NULL)
        return;
    /* What was sent is seen before the word is: the sleeper sets it, and then
     * looks again. */
    atomic_thread_fence(memory_order_seq_cst);
    if (atomic_load_explicit(bell, memory_order_relaxed) != 0 &&
        atomic_exchange(bell, 0) != 0)
        (void)syscall(SYS_futex, bell, FUTEX_WAKE, 1, NULL, NULL, 0);
}

static bool done(MPI_Request request) {
    int flag = 0;
    MPI_Request_get_status(request, &flag, MPI_STATUS_IGNORE);
    return flag != 0;
}

static unsigned slot_of(uint32_t message) {
    return message % MPI_PIPE_SLOTS;
}

/* Whether the caller has something to do with this pipe. */
static bool ready(struct mpi_pipe *pipe) {
    return pipe->in_size >= 0 || done(pipe->in[slot_of(pipe->taken)]) ||
           (pipe->blocked && done(pipe->out[slot_of(pipe->sent)]));
}

/* A peer that was rung before the message was there sleeps again. */
static void settle(struct mpi_pipe *pipe) {
    if (pipe->pending && done(pipe->out[slot_of(pipe->sent - 1)])) {
        pipe->pending = false;
        mpi_ring(pipe->place, pipe->peer);
    }
}

void mpi_sleep(struct mpi_place *place, struct mpi_pipe *pipes, unsigned count,
               MPI_Request *request, uint64_t wait_us) {
    uint64_t start = now_us(), passed = 0;
    _Atomic uint32_t *bell = place->bell[place->rank];
    while (passed < wait_us) {
        /* A peer elsewhere does not ring, and what MPI has not yet sent needs
         * a call of it to go on. */
        uint64_t slice = wait_us - passed;
        atomic_store(bell, 1); /* before the last look */
        bool some = request != NULL && done(*request);
        if (slice > MPI_LOOK_US && request != NULL && place->bell[0] == NULL)
            slice = MPI_LOOK_US;
        for (unsigned i = 0; i < count; i++) {
            settle(&pipes[i]);
            some = some || ready(&pipes[i]);
            if (slice > MPI_LOOK_US &&
                (place->bell[pipes[i].peer] == NULL || pipes[i].pending))
                slice = MPI_LOOK_US;
        }
        if (!some) {
            struct timespec wait = {(time_t)(slice / 1000000),
                                    (long)(slice % 1000000) * 1000};
            (void)syscall(SYS_futex, bell, FUTEX_WAIT, 1, &wait, NULL, 0);
        }
        if (atomic_exchange(bell, 0) == 0 || some)
            return;
        passed = now_us() - start;
    }
}

/* --- the pipe ------------------------------------------------------------- */

static void expect(struct mpi_pipe *pipe, uint32_t message) {
    unsigned slot = slot_of(message);
    MPI_Irecv(pipe->in_bytes[slot], MPI_PIPE_BYTES, MPI_BYTE, pipe->peer,
              pipe->tag, pipe->place->comm, &pipe->in[slot]);
}

void mpi_pipe_open(struct mpi_pipe *pipe, struct mpi_place *place, int peer,
                   int tag) {
    memset(pipe, 0, offsetof(struct mpi_pipe, out_bytes));
    pipe->place = place;
    pipe->peer = peer;
    pipe->tag = tag;
    pipe->in_size = -1;
    for (unsigned i = 0; i < MPI_PIPE_SLOTS; i++) {
        pipe->out[i] = MPI_REQUEST_NULL;
        expect(pipe, i);
    }
}

static int mpi_send(void *context, const uint8_t *bytes, size_t size) {
    struct mpi_pipe *pipe = context;
    size_t sent = 0;
    if (pipe->closed)
        return LINK_PIPE_CLOSED;
    for (unsigned i = 0; i < MPI_PIPE_SLOTS && sent < size; i++) {
        unsigned slot = slot_of(pipe->sent);
        MPI_Request *request = &pipe->out[slot];
        int complete = 0;
        MPI_Test(request, &complete, MPI_STATUS_IGNORE);
        if (!complete)
            break;
        size_t part =
            size - sent < MPI_PIPE_BYTES ? size - sent : MPI_PIPE_BYTES;
        memcpy(pipe->out_bytes[slot], bytes + sent, part);
        (slot == 0 ? MPI_Issend : MPI_Isend)(pipe->out_bytes[slot], (int)part,
                                             MPI_BYTE, pipe->peer, pipe->tag,
                                             pipe->place->comm, request);
        pipe->sent++;
        sent += part;
    }
    pipe->blocked = sent < size;
    if (sent > 0) {
        pipe->pending = true;
        mpi_ring(pipe->place, pipe->peer);
    }
    return (int)sent;
}

static int mpi_receive(void *context, uint8_t *bytes, size_t size) {
    struct mpi_pipe *pipe = context;
    size_t got = 0;
    if (pipe->closed)
        return LINK_PIPE_CLOSED;
    settle(pipe);
    for (unsigned i = 0; i < MPI_PIPE_SLOTS && got < size; i++) {
        unsigned slot = slot_of(pipe->taken);
        if (pipe->in_size < 0) {
            int complete = 0;
            MPI_Status status;
            MPI_Test(&pipe->in[slot], &complete, &status);
            if (!complete)
                break;
            MPI_Get_count(&status, MPI_BYTE, &pipe->in_size);
            pipe->at = 0;
            pipe->closed = pipe->in_size == 0;
            if (pipe->closed) {
                pipe->taken++;
                pipe->blocked = pipe->pending = false;
                pipe->in_size = -1;
                break;
            }
        }
        size_t rest = (size_t)pipe->in_size - pipe->at;
        size_t part = rest < size - got ? rest : size - got;
        memcpy(bytes + got, pipe->in_bytes[slot] + pipe->at, part);
        got += part;
        pipe->at += part;
        if (part == rest) {
            pipe->in_size = -1;
            expect(pipe, pipe->taken++);
        }
    }
    return (int)got;
}

void mpi_pipe_end(struct mpi_pipe *pipe) {
    MPI_Request *request = &pipe->out[slot_of(pipe->sent)];
    int complete = 0;
    MPI_Test(request, &complete, MPI_STATUS_IGNORE);
    if (complete && !pipe->closed) { /* else it is noticed later */
        MPI_Isend(NULL, 0, MPI_BYTE, pipe->peer, pipe->tag, pipe->place->comm,
                  request);
        pipe->sent++;
        mpi_ring(pipe->place, pipe->peer);
    }
}

struct link_pipe mpi_link_pipe(struct mpi_pipe *pipe) {
    return (struct link_pipe){pipe, mpi_send, mpi_receive};
}

/* --- parting -------------------------------------------------------------- */

/* Drops what still comes, so that all that the peer sent gets complete.
 * Whether all that was sent from here is. */
static bool drain(struct mpi_pipe *pipe) {
    uint8_t bytes[256];
    int complete = 0;
    for (unsigned i = 0; i < MPI_PIPE_SLOTS * MPI_PIPE_BYTES / sizeof bytes &&
                         mpi_receive(pipe, bytes, sizeof bytes) > 0;
         i++) {
    }
    MPI_Testall(MPI_PIPE_SLOTS, pipe->out, &complete, MPI_STATUSES_IGNORE);
    return complete != 0;
}

static void close_pipe(struct mpi_pipe *pipe) {
    for (unsigned i = 0; i < MPI_PIPE_SLOTS; i++)
        if (pipe->in[i] != MPI_REQUEST_NULL)
            MPI_Cancel(&pipe->in[i]);
    MPI_Waitall(MPI_PIPE_SLOTS, pipe->in, MPI_STATUSES_IGNORE);
    pipe->closed = true;
}

bool mpi_place_part(struct mpi_place *place, struct mpi_pipe *pipes,
                    unsigned count, uint64_t wait_us) {
    uint64_t start = now_us();
    MPI_Request all = MPI_REQUEST_NULL;
    bool sent = false;
    int complete = 0;
    /* Synchronous messages are complete when they were taken, and others were
     * sent before them or are in the peer's receives. */
    while (!complete) {
        bool clear = true;
        for (unsigned i = 0; i < count; i++)
            clear = drain(&pipes[i]) && clear;
        if (clear && !sent) {
            MPI_Ibarrier(place->comm, &all);
            sent = true;
        }
        if (sent)
            MPI_Test(&all, &complete, MPI_STATUS_IGNORE);
        if (now_us() - start > wait_us)
            return false;
        if (!complete)
            mpi_sleep(place, pipes, count, NULL, MPI_LOOK_US);
    }
    for (unsigned i = 0; i < count; i++)
        close_pipe(&pipes[i]);
    return true;
}
