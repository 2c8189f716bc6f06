/* A Modbus server by libmodbus: an independent peer for the adapter's tests.

       modbus_libmodbus tcp PORT
       modbus_libmodbus rtu DEVICE UNIT

   Prints `READY port`, then takes commands on stdin, one a line, and answers each
   with `OK` or `ERROR`:

       set TABLE ADDRESS VALUE...   changes values; TABLE is coil, discrete, holding
                                    or input
       stamp                        from now on every four holding registers hold
                                    the unit asked, their number, and the number of
                                    the request (high, low)
       late MILLIS COUNT            the next COUNT answers come so late, in order
*/

#include <errno.h>
#include <modbus/modbus.h>
#include <poll.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define CELLS 2048
#define MAX_CONNECTIONS 16
#define MAX_LINE 4096

static modbus_t *context;
static modbus_mapping_t *cells;
static bool has_stamps;
static unsigned sequence, late_millis, late_count;

static void stamp(unsigned unit) {
    sequence++;
    for (unsigned i = 0; i + 3 < CELLS; i += 4) {
        uint16_t *four = cells->tab_registers + i;
        four[0] = (uint16_t)unit;
        four[1] = (uint16_t)(i / 4);
        four[2] = (uint16_t)(sequence >> 16);
        four[3] = (uint16_t)sequence;
    }
}

/* Answers one request; false when the other end is gone. */
static bool serve(void) {
    uint8_t request[MODBUS_MAX_ADU_LENGTH];
    int length = modbus_receive(context, request);
    if (length == 0) return true; /* For another unit. */
    if (length < 0) return errno == EMBBADCRC || errno == ETIMEDOUT;
    if (has_stamps) stamp(request[modbus_get_header_length(context) - 1]);
    if (late_count > 0) {
        late_count--;
        usleep(late_millis * 1000);
    }
    return modbus_reply(context, request, length, cells) >= 0;
}

static bool set(char *words) {
    char *table = strtok(words, " "), *word = strtok(NULL, " ");
    if (!table || !word) return false;
    for (unsigned address = (unsigned)atoi(word); (word = strtok(NULL, " ")); address++) {
        uint16_t value = (uint16_t)atoi(word);
        if (address >= CELLS) return false;
        if (!strcmp(table, "coil")) cells->tab_bits[address] = value != 0;
        else if (!strcmp(table, "discrete")) cells->tab_input_bits[address] = value != 0;
        else if (!strcmp(table, "holding")) cells->tab_registers[address] = value;
        else if (!strcmp(table, "input")) cells->tab_input_registers[address] = value;
        else return false;
    }
    return true;
}

/* Carries out a command; false at the end of stdin. */
static bool obey(void) {
    char line[MAX_LINE];
    if (!fgets(line, sizeof line, stdin)) return false;
    line[strcspn(line, "\n")] = 0;
    bool done = true;
    if (!strncmp(line, "set ", 4)) done = set(line + 4);
    else if (!strcmp(line, "stamp")) has_stamps = true;
    else done = sscanf(line, "late %u %u", &late_millis, &late_count) == 2;
    puts(done ? "OK" : "ERROR");
    return true;
}

static int open_tcp(int port) {
    context = modbus_new_tcp("127.0.0.1", port);
    return context ? modbus_tcp_listen(context, MAX_CONNECTIONS) : -1;
}

static int open_rtu(const char *device, int unit) {
    context = modbus_new_rtu(device, 19200, 'N', 8, 1);
    if (!context || modbus_set_slave(context, unit) < 0 || modbus_connect(context) < 0) return -1;
    return modbus_get_socket(context);
}

int main(int count, char **words) {
    setvbuf(stdin, NULL, _IONBF, 0); /* So that poll knows all that is there. */
    setvbuf(stdout, NULL, _IOLBF, 0);
    bool is_tcp = count == 3 && !strcmp(words[1], "tcp");
    bool is_rtu = count == 4 && !strcmp(words[1], "rtu");
    if (!is_tcp && !is_rtu) return fputs("usage: tcp PORT | rtu DEVICE UNIT\n", stderr), 2;
    cells = modbus_mapping_new(CELLS, CELLS, CELLS, CELLS);
    int first = is_tcp ? open_tcp(atoi(words[2])) : open_rtu(words[2], atoi(words[3]));
    if (!cells || first < 0) return perror("modbus_libmodbus"), 1;
    printf("READY %s\n", is_tcp ? words[2] : "0");

    /* stdin, the listener or the line, connections. */
    struct pollfd watched[2 + MAX_CONNECTIONS] = {{0, POLLIN, 0}, {first, POLLIN, 0}};
    nfds_t open = 2;
    while (poll(watched, open, -1) >= 0) {
        if (watched[0].revents && !obey()) return 0;
        if (watched[1].revents && is_rtu) serve();
        for (nfds_t i = 2; i < open; i++) {
            if (!watched[i].revents) continue;
            modbus_set_socket(context, watched[i].fd);
            if (serve()) continue;
            close(watched[i].fd);
            watched[i--] = watched[--open];
        }
        if (watched[1].revents && is_tcp && open < 2 + MAX_CONNECTIONS) {
            int made = modbus_tcp_accept(context, &first);
            if (made >= 0) watched[open++] = (struct pollfd){made, POLLIN, 0};
        }
    }
    return 1;
}
