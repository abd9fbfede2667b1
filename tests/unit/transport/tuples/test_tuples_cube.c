/* The tuple space over a cube: each node carries a place, and what a master
 * puts in, workers that eval has started take, work on and put back. */
#include "tests/unit/transport/cube_machine.h"

#include "transport/tuples/tuples.h"

enum { MESSAGE = 99, JOBS = 200, FACES = 360, WORKERS_MAX = NODES_MAX };

struct worker {
    bool started;
    int taking, putting;
    uint32_t done;
};

struct party {
    struct machine *machine;
    struct tuples *space[NODES_MAX];
    struct party_place {
        struct party *party;
        uint16_t self;
    } place[NODES_MAX];
    struct worker worker[NODES_MAX];
    uint32_t refused;
};

static int write_message(void *context, uint16_t place, const void *data,
                         size_t size) {
    struct party_place *p = context;
    int status = cube_write(p->party->machine->places[p->self].cube, place,
                            MESSAGE, data, size);
    p->party->refused += status != 0;
    return status;
}

static struct tuple job_pattern(void) {
    struct tuple t = {.count = 3};
    t.field[0] = TUPLE_UINT32('j');
    t.field[1] = TUPLE_FORMAL(TUPLE_TYPE_UINT32);
    t.field[2] = TUPLE_FORMAL(TUPLE_TYPE_BYTES);
    return t;
}

/* A tetrahedron builder: takes jobs until there is one without faces. */
static bool work(void *context, struct tuple *tuple) {
    struct party_place *p = context;
    struct worker *worker = &p->party->worker[p->self];
    struct tuples *space = p->party->space[p->self];
    struct tuple pattern = job_pattern(), t;
    if (!worker->started) {
        worker->started = true;
        worker->taking = tuples_in(space, &pattern);
        worker->putting = -1;
    }
    if (worker->putting >= 0) {
        if (tuples_poll(space, worker->putting, &t) != TUPLES_DONE)
            return false;
        tuples_close(space, worker->putting);
        worker->putting = -1;
        worker->taking = tuples_in(space, &pattern);
    }
    if (tuples_poll(space, worker->taking, &t) != TUPLES_DONE)
        return false;
    if (t.field[2].size == 0) {
        tuples_close(space, worker->taking);
        tuple->field[1] = TUPLE_UINT32(worker->done);
        return true;
    }
    worker->done++;
    t.field[0] = TUPLE_UINT32('r');
    worker->putting = tuples_out(space, &t);
    assert_true(worker->putting >= 0);
    tuples_close(space, worker->taking);
    return false;
}

static tuples_function *const functions[] = {work};

static void open_party(struct party *p, struct machine *m) {
    struct tuples_config config = {0};
    p->machine = m;
    config.places = (uint16_t)m->nodes;
    config.operations = 4;
    config.processes = 1;
    config.tuple_bytes = 512;
    config.store_bytes = 4000;
    config.functions = functions;
    config.function_count = 1;
    config.write = write_message;
    for (unsigned i = 0; i < m->nodes; i++) {
        p->place[i].party = p;
        p->place[i].self = config.self = (uint16_t)i;
        config.context = &p->place[i];
        size_t bytes = tuples_arena_bytes(&config);
        p->space[i] = tuples_init(malloc(bytes), bytes, &config, 1);
        assert_non_null(p->space[i]);
    }
}

static void turn(struct party *p) {
    struct machine *m = p->machine;
    m->now_us += 20 + draw(m) % 80;
    for (unsigned i = 0; i < m->count; i++) {
        struct cube_message message;
        struct cube *cube = m->places[i].cube;
        cube_poll(cube, m->now_us);
        while (i < m->nodes && cube_read(cube, &message)) {
            assert_int_equal(message.type, MESSAGE);
            assert_true(tuples_take(p->space[i], message.source, message.data,
                                    message.size));
            cube_release(cube);
        }
        if (i < m->nodes)
            tuples_step(p->space[i]);
    }
}

static enum tuples_status wait_for(struct party *p, int number,
                                   struct tuple *t) {
    enum tuples_status status = TUPLES_PENDING;
    assert_true(number >= 0);
    for (unsigned i = 0; status == TUPLES_PENDING; i++) {
        assert_true(i < 100000);
        turn(p);
        status = tuples_poll(p->space[0], number, t);
    }
    return status;
}

static void put(struct party *p, uint32_t number, const void *faces,
                unsigned size) {
    struct tuple t = job_pattern();
    t.field[1] = TUPLE_UINT32(number);
    t.field[2] = TUPLE_BYTES(faces, size);
    int out = tuples_out(p->space[0], &t);
    assert_int_equal(wait_for(p, out, &t), TUPLES_DONE);
    tuples_close(p->space[0], out);
}

static void master(struct party *p, unsigned workers) {
    uint8_t faces[FACES];
    struct tuple t = {.count = 2}, pattern = job_pattern();
    bool got[JOBS] = {false};
    uint32_t done = 0;
    t.field[0] = TUPLE_UINT32('w');
    t.field[1] = TUPLE_UINT32(0);
    for (unsigned i = 0; i < workers; i++) {
        struct tuple begun = t;
        int eval = tuples_eval(p->space[0], 0, &begun);
        assert_int_equal(wait_for(p, eval, &begun), TUPLES_DONE);
        tuples_close(p->space[0], eval);
    }
    pattern.field[0] = TUPLE_UINT32('r');
    for (uint32_t i = 0, jobs = 0; i < JOBS; i++) {
        for (; jobs < JOBS && jobs - i < 3; jobs++) {
            memset(faces, (int)jobs, sizeof faces);
            put(p, jobs, faces, 1 + jobs % FACES);
        }
        int in = tuples_in(p->space[0], &pattern);
        assert_int_equal(wait_for(p, in, &t), TUPLES_DONE);
        uint32_t number = t.field[1].as.uint32;
        assert_true(number < jobs && !got[number]);
        got[number] = true;
        assert_int_equal(t.field[2].size, 1 + number % FACES);
        assert_int_equal(((const uint8_t *)t.field[2].as.bytes)[0],
                         (uint8_t)number);
        tuples_close(p->space[0], in);
    }
    pattern.count = 2;
    pattern.field[0] = TUPLE_UINT32('w');
    for (unsigned i = 0; i < workers; i++)
        put(p, i, NULL, 0);
    for (unsigned i = 0; i < workers; i++) {
        int in = tuples_in(p->space[0], &pattern);
        assert_int_equal(wait_for(p, in, &t), TUPLES_DONE);
        done += t.field[1].as.uint32;
        tuples_close(p->space[0], in);
    }
    assert_int_equal(done, JOBS);
}

TEST(triangulates) {
    static const struct cube_config usual = {.window = 2};
    struct host_sim_cube_options bad = perfect;
    bad.faults.chance[SIM_DELETE] = 2e-5;
    bad.faults.chance[SIM_FLIP] = 1e-5;
    for (uint64_t seed = 0; seed < 3; seed++) {
        for (unsigned dimension = 0; dimension <= 4; dimension++) {
            struct party *p = calloc(1, sizeof *p);
            assert_non_null(p);
            struct machine *m =
                build(dimension, &usual, seed == 2 ? &bad : &perfect, seed);
            open_party(p, m);
            master(p, m->nodes == 1 ? 1 : m->nodes - 1);
            for (unsigned i = 0; i < 2000; i++)
                turn(p);
            for (unsigned i = 0; i < m->nodes; i++) {
                assert_int_equal(tuples_held(p->space[i]), 0);
                free(p->space[i]);
            }
            destroy(m);
            free(p);
        }
    }
}
