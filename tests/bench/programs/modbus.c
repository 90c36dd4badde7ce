/* The server that all clients of exchanges.py talk to, and two clients in C: one that does nothing but send and receive,
   and libmodbus's.  cc -O2 -o modbus modbus.c -ldl

   modbus serve                    answers function 03; prints its port
   modbus plain PORT MILLISECONDS  exchanges as fast as it goes; prints how many
   modbus libmodbus PORT MILLISECONDS */
#include <arpa/inet.h>
#include <dlfcn.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

enum { CALLERS = 4096, REGISTERS = 10, HEADER = 6, LONGEST = 260 };

static long long now_us(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec * 1000000LL + t.tv_nsec / 1000;
}

static void at_once(int s)
{
    int on = 1;
    setsockopt(s, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
}

/* One whole frame; 0 when the other side is gone. */
static int frame(int s, uint8_t *to)
{
    int have = 0, want = HEADER;
    while (have < want) {
        int n = recv(s, to + have, want - have, 0);
        if (n <= 0)
            return 0;
        have += n;
        if (have >= HEADER) {
            want = HEADER + (to[4] << 8 | to[5]);
            if (want > LONGEST)
                return 0;
        }
    }
    return have;
}

static int answer(int s)
{
    uint8_t query[LONGEST], reply[LONGEST];
    if (frame(s, query) < 12 || query[7] != 3)
        return 0;
    int first = query[8] << 8 | query[9], count = query[10] << 8 | query[11];
    if (count > 125)
        return 0;
    memcpy(reply, query, 8);
    reply[4] = 0;
    reply[5] = 3 + 2 * count;
    reply[8] = 2 * count;
    for (int i = 0; i < count; i++) {
        uint16_t value = 1000 + first + i;
        reply[9 + 2 * i] = value >> 8;
        reply[10 + 2 * i] = value;
    }
    return send(s, reply, 9 + 2 * count, MSG_NOSIGNAL) == 9 + 2 * count;
}

static int serve(void)
{
    static struct pollfd seen[CALLERS + 1];
    struct sockaddr_in at = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t size = sizeof at;
    int used = 1, door = socket(AF_INET, SOCK_STREAM, 0);
    if (bind(door, (struct sockaddr *)&at, size) || listen(door, CALLERS) || getsockname(door, (struct sockaddr *)&at, &size))
        return 1;
    printf("%d\n", ntohs(at.sin_port));
    fflush(stdout);
    seen[0] = (struct pollfd){.fd = door, .events = POLLIN};
    for (;;) {
        if (poll(seen, used, -1) < 0)
            return 1;
        for (int i = used - 1; i > 0; i--)
            if (seen[i].revents && !answer(seen[i].fd)) {
                close(seen[i].fd);
                seen[i] = seen[--used];
            }
        if (seen[0].revents && used <= CALLERS) {
            int s = accept(door, 0, 0);
            at_once(s);
            seen[used++] = (struct pollfd){.fd = s, .events = POLLIN};
        }
    }
}

static long plain(int port, long ms)
{
    struct sockaddr_in to = {.sin_family = AF_INET, .sin_port = htons(port), .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    int s = socket(AF_INET, SOCK_STREAM, 0);
    if (connect(s, (struct sockaddr *)&to, sizeof to))
        return -1;
    at_once(s);
    uint8_t query[12] = {0, 0, 0, 0, 0, 6, 1, 3, 0, 0, 0, REGISTERS}, reply[LONGEST];
    long done = 0;
    for (long long end = now_us() + ms * 1000; now_us() < end; done++) {
        query[0] = done >> 8;
        query[1] = done;
        if (send(s, query, sizeof query, 0) != sizeof query || frame(s, reply) != 9 + 2 * REGISTERS || memcmp(query, reply, 2))
            return -1;
    }
    return done;
}

static long libmodbus(int port, long ms)
{
    void *library = dlopen("libmodbus.so.5", RTLD_NOW);
    if (!library)
        return -1;
    void *(*make)(const char *, int) = (void *(*)(const char *, int))dlsym(library, "modbus_new_tcp");
    int (*join)(void *) = (int (*)(void *))dlsym(library, "modbus_connect");
    int (*ask)(void *, int, int, uint16_t *) = (int (*)(void *, int, int, uint16_t *))dlsym(library, "modbus_read_registers");
    void *client = make("127.0.0.1", port);
    uint16_t registers[REGISTERS];
    if (!client || join(client))
        return -1;
    long done = 0;
    for (long long end = now_us() + ms * 1000; now_us() < end; done++)
        if (ask(client, 0, REGISTERS, registers) != REGISTERS)
            return -1;
    return done;
}

int main(int count, char **words)
{
    if (count == 2 && !strcmp(words[1], "serve"))
        return serve();
    if (count != 4)
        return 2;
    long done = (strcmp(words[1], "plain") ? libmodbus : plain)(atoi(words[2]), atol(words[3]));
    if (done < 0)
        return 1;
    printf("%ld\n", done);
    return 0;
}
