/* A node that speaks as the host, or as another node: what it says under their
 * numbers is dropped by the first honest node, unless it is on the way from
 * them; whether its message is for that node, for one behind it, or for all;
 * by e-cube, with many host ports, by the spare one, and round dead wires. */
#include "cube_machine.h"
#include "transport/bytes.h"
#include "transport/cube_internal.h"

enum { TYPE = 77, FORGED_BYTES = 4 };

/* By place: which of the forged messages were read, of each source and
 * destination (one more of those: all). */
static bool seen[ENDS_MAX][ENDS_MAX][ENDS_MAX + 1];

static uint16_t name_of(const struct machine *m, unsigned place) {
    return place == m->nodes ? CUBE_HOST : (uint16_t)place;
}

/* The node by which the host and that node reach each other. */
static unsigned port_for(const struct machine *m, unsigned node) {
    const struct cube *cube = m->places[node].cube;
    bool many = cube->config.host_ports > 1 && !cube->routes.tree;
    return many ? node & (cube->config.host_ports - 1u) : cube->wiring.gateway;
}

/* Whether the way from `from` to `to` leads out of node `by` by that link: hop
 * by hop, as each node sends. */
static bool leads_over(const struct machine *m, unsigned from, unsigned to,
                       unsigned by, unsigned link) {
    unsigned end = to == m->nodes ? port_for(m, from) : to;
    unsigned at = from == m->nodes ? port_for(m, to) : from;
    while (at != end) {
        const struct routes *routes = &m->places[at].cube->routes;
        unsigned way = routes_way(routes, at, end);
        if (way == ROUTES_NONE || (at == by && way == link))
            return way != ROUTES_NONE;
        at ^= 1u << way;
    }
    return to == m->nodes && at == by && link == m->dimension;
}

static void read_all(struct machine *m) {
    struct cube_message message;
    for (unsigned i = 0; i < m->count; i++) {
        while (!m->places[i].gone && cube_read(m->places[i].cube, &message)) {
            assert_int_equal(message.type, TYPE);
            assert_int_equal(message.size, FORGED_BYTES);
            unsigned from = bytes_get16(message.data);
            assert_int_equal(message.source, name_of(m, from));
            seen[i][from][bytes_get16(message.data + 2)] = true;
            cube_release(m->places[i].cube);
        }
    }
}

/* Node `by` writes to a link, under a number of its choice. */
static void forge(struct machine *m, unsigned by, unsigned link, unsigned from,
                  unsigned to) {
    struct cube *cube = m->places[by].cube;
    uint8_t head[CUBE_HEAD] = {0}, data[FORGED_BYTES];
    bytes_put16(head, to == m->count ? CUBE_ALL : name_of(m, to));
    bytes_put16(head + 2, name_of(m, from));
    head[4] = TYPE;
    bytes_put16(head + 6, cube->stamp);
    bytes_put16(data, (uint16_t)from);
    bytes_put16(data + 2, (uint16_t)to);
    for (unsigned i = 0; link_room(cube->links[link], sizeof head) == 0; i++) {
        assert_true(i < 1000);
        poll_all(m, 100);
        read_all(m);
    }
    assert_int_equal(
        link_write(cube->links[link], head, sizeof head, data, sizeof data), 0);
}

/* Whatever it says by a link arrives where the way from its source leads by
 * that link, and nowhere else. */
static void speak_by(struct machine *m, unsigned by, unsigned link) {
    memset(seen, 0, sizeof seen);
    for (unsigned from = 0; from < m->count; from++) {
        for (unsigned to = 0; to <= m->count; to++)
            if (from != to)
                forge(m, by, link, from, to);
    }
    for (unsigned i = 0; i < 100; i++) {
        poll_all(m, 100);
        read_all(m);
    }
    for (unsigned i = 0; i < m->count; i++) {
        for (unsigned from = 0; from < m->count; from++) {
            if (m->places[from].gone)
                continue; /* at the gateway nothing is known against it */
            bool due = i != from && i != by && leads_over(m, from, i, by, link);
            assert_int_equal(seen[i][from][i], due);
            assert_int_equal(seen[i][from][m->count],
                             due && i != m->nodes && from != i);
            for (unsigned to = 0; to < m->count; to++)
                assert_true(to == i || !seen[i][from][to]);
        }
    }
}

static void speak(struct machine *m) {
    for (unsigned by = 0; by < m->nodes; by++) {
        for (unsigned d = 0;
             !m->places[by].gone && d < cube_links(m->places[by].cube); d++)
            if (!cube_link_is_dead(m->places[by].cube, d))
                speak_by(m, by, d);
    }
}

TEST(no_node_speaks_as_another_end) {
    for (unsigned d = 1; d <= 4; d++) {
        struct cube_config c = {.window = 8};
        struct machine *m = build(d, &c, &perfect, d);
        settle(m, 1);
        speak(m);
        destroy(m);
    }
}

TEST(nor_where_the_host_has_many_wires) {
    for (unsigned ports = 2; ports <= 8; ports *= 2) {
        struct cube_config c = {.window = 8, .host_ports = (uint8_t)ports};
        struct machine *m = build(3, &c, &perfect, ports);
        settle(m, 1);
        speak(m);
        destroy(m);
    }
}

/* A dead wire, a dead node, a gateway that has moved. */
TEST(nor_off_the_e_cube_path) {
    for (unsigned round = 0; round < 12; round++) {
        struct cube_config c = {.window = 8,
                                .dead_us = 200000,
                                .spare_node = (uint16_t)(round % 3 * 3),
                                .host_ports = round == 3 ? 4 : 0};
        struct machine *m = build(3, &c, &perfect, round);
        struct cube *host = m->places[m->nodes].cube;
        settle(m, 1);
        struct cube_wiring next = *cube_wiring(host);
        if (round % 2 == 0) {
            cut_wire(m, round % 8, round % 3);
            next.dead[0] =
                (struct cube_dead){(uint16_t)(round % 8 & ~(1u << round % 3)),
                                   (uint8_t)(round % 3)};
        } else {
            m->places[round % 7 + 1].gone = true;
            next.dead[0] =
                (struct cube_dead){(uint16_t)(round % 7 + 1), CUBE_WHOLE_NODE};
        }
        next.dead_count = 1;
        if (c.spare_node != 0 && !m->places[c.spare_node].gone)
            next.gateway = c.spare_node;
        cube_renew(host, &next);
        settle(m, 2);
        assert_true(host->routes.tree);
        speak(m);
        destroy(m);
    }
}
