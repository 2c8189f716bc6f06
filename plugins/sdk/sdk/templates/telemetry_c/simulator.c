/* A device to try the plugin with: `make build/simulator && ./build/simulator`. */

#define _POSIX_C_SOURCE 200809L

#include <arpa/inet.h>
#include <math.h>
#include <netinet/in.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

/* Writes a line for each value until the client goes. */
static void serve(int client) {
    char text[128];
    int len, step = 0;
    do {
        double temperature = 60.0 + 5.0 * sin(step++ / 50.0);
        len = snprintf(text, sizeof text, "temperature %.2f\nalarm %d\n", temperature,
                       temperature > 63.0);
        nanosleep(&(struct timespec){0, 200000000}, NULL);
    } while (send(client, text, (size_t)len, MSG_NOSIGNAL) == len);
    close(client);
}

int main(int argc, char **argv) {
    struct sockaddr_in address = {.sin_family = AF_INET};
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons((in_port_t)(argc > 1 ? atoi(argv[1]) : 7070));
    socklen_t size = sizeof address;
    int listener = socket(AF_INET, SOCK_STREAM, 0);
    setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &(int){1}, sizeof(int));
    if (bind(listener, (struct sockaddr *)&address, size) != 0 || listen(listener, 8) != 0 ||
        getsockname(listener, (struct sockaddr *)&address, &size) != 0) {
        perror("simulator");
        return 1;
    }
    printf("listening on 127.0.0.1:%d\n", ntohs(address.sin_port));
    fflush(stdout);
    signal(SIGCHLD, SIG_IGN);
    for (;;) {
        int client = accept(listener, NULL, NULL);
        if (client >= 0 && fork() == 0) {
            serve(client);
            return 0;
        }
        close(client);
    }
}
