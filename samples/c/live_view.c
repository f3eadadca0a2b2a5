/* A live view of one's own, by the C API alone: a page on this computer shows the left video, the
 * surface's vertices coloured by status, state and latency, while a sequence is tracked.
 *   live_view LEFT RIGHT FX,FY,CX,CY,BASELINE_MM ROUNDS [DEVICE_ID]
 * The sequence is tracked ROUNDS times, forth and back, at 30 frames a second. The address that is
 * printed holds a token; keep it to yourself. The browser asks for frames: one that is slow or
 * gone harms nothing, because the tracker's thread only leaves a copy where no request holds it. */
#define _POSIX_C_SOURCE 200809L
#include <arpa/inet.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#include "tracking.h"

static const char page[] =
    "<!doctype html><meta charset=utf-8><title>defrec</title>"
    "<style>body{background:#111;color:#ddd;font:16px sans-serif}canvas{width:100%;max-width:960px}"
    "</style><p id=text>waiting<p><canvas id=view></canvas><script>\n"
    "const view = document.getElementById('view'), text = document.getElementById('text');\n"
    "const colours = ['#40dc60', '#ffb020', '#888'];\n"
    "async function show() {\n"
    "  const answer = await fetch('frame');\n"
    "  if (answer.status !== 200) return new Promise(done => setTimeout(done, 100));\n"
    "  const bytes = await answer.arrayBuffer();\n"
    "  const end = new Uint8Array(bytes).indexOf(10);\n"
    "  const facts = JSON.parse(new TextDecoder().decode(bytes.slice(0, end)));\n"
    "  const size = facts.width * facts.height, bgr = new Uint8Array(bytes, end + 1, 3 * size);\n"
    "  const points = new DataView(bytes, end + 1 + 3 * size);\n"
    "  view.width = facts.width; view.height = facts.height;\n"
    "  const context = view.getContext('2d');\n"
    "  const image = context.createImageData(facts.width, facts.height);\n"
    "  for (let i = 0; i < size; ++i) for (let k = 0; k < 4; ++k)\n"
    "    image.data[4 * i + k] = k < 3 ? bgr[3 * i + 2 - k] : 255;\n"
    "  context.putImageData(image, 0, 0);\n"
    "  for (let i = 0; i < facts.vertices; ++i) {\n"
    "    context.fillStyle = colours[points.getFloat32(12 * i + 8, true)] || colours[2];\n"
    "    context.fillRect(points.getFloat32(12 * i, true) - 1, points.getFloat32(12 * i + 4, true) "
    "- 1, 2, 2);\n"
    "  }\n"
    "  const isOld = facts.age_ms > 1000;\n"
    "  view.style.filter = isOld ? 'grayscale(1)' : '';\n"
    "  text.textContent = isOld ? `no new picture for ${(facts.age_ms / 1000).toFixed(1)} s` :\n"
    "    `frame ${facts.frame}: ${facts.state}, ${facts.latency_ms.toFixed(1)} ms`;\n"
    "}\n"
    "async function run() {\n"
    "  for (;;) { await show(); await new Promise(requestAnimationFrame); }\n"
    "}\n"
    "run().catch(() => { text.textContent = 'ended'; });\n"
    "</script>";

static int64_t now_ns(void) {
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (int64_t)time.tv_sec * 1000000000 + time.tv_nsec;
}

/* ---- what the tracker leaves for browsers ---- */

typedef struct {
    pthread_mutex_t mutex;
    char facts[256]; /* a line of JSON, without the age */
    int64_t left_ns;
    uint8_t* pixels; /* BGR, the left image */
    size_t pixel_bytes;
    float* vertices; /* u, v in the left image, DEFREC_POINT_... */
    size_t vertex_count, vertex_room;
} shown_frame;

static const char* state_name(uint32_t state) {
    static const char* const names[] = {[DEFREC_INITIALISING] = "initialising",
                                        [DEFREC_TRACKING] = "tracking",
                                        [DEFREC_DEGRADED] = "degraded",
                                        [DEFREC_LOST] = "lost",
                                        [DEFREC_RELOCALISED] = "relocalised"};
    return state < sizeof names / sizeof *names ? names[state] : "unknown";
}

/* Never waits: while a request reads, the frame is not shown. */
static void leave(shown_frame* shown, const image* left, const defrec_result* result,
                  const defrec_camera* camera, size_t number, int64_t submitted_ns) {
    size_t i;
    if (pthread_mutex_trylock(&shown->mutex) != 0) return;
    memcpy(shown->pixels, left->pixels, shown->pixel_bytes);
    if (result->vertex_count > shown->vertex_room) {
        float* more = realloc(shown->vertices, 3 * sizeof(float) * result->vertex_count);
        if (more == NULL) fail("no memory for %u vertices", (unsigned)result->vertex_count);
        shown->vertices = more;
        shown->vertex_room = result->vertex_count;
    }
    shown->vertex_count = result->vertex_count;
    for (i = 0; i < shown->vertex_count; ++i) {
        const float* vertex = result->vertices + 3 * i;
        shown->vertices[3 * i] = (float)(camera->fx * vertex[0] / vertex[2] + camera->cx);
        shown->vertices[3 * i + 1] = (float)(camera->fy * vertex[1] / vertex[2] + camera->cy);
        shown->vertices[3 * i + 2] = result->vertex_status[i];
    }
    snprintf(shown->facts, sizeof shown->facts,
             "\"frame\": %zu, \"state\": \"%s\", \"latency_ms\": %.3f, \"width\": %u, "
             "\"height\": %u, \"vertices\": %zu}\n",
             number, state_name(result->state), (double)(now_ns() - submitted_ns) * 1e-6,
             left->width, left->height, shown->vertex_count);
    shown->left_ns = now_ns();
    pthread_mutex_unlock(&shown->mutex);
}

/* ---- the server: one request after the other, each on a connection of its own ---- */

typedef struct {
    shown_frame* shown;
    int listener;
    unsigned port;
    char token[33];
} view_server;

static int send_all(int connection, const void* bytes, size_t size) {
    const char* at = bytes;
    while (size > 0) {
        const ssize_t sent = send(connection, at, size, MSG_NOSIGNAL);
        if (sent <= 0) return 0;
        at += sent;
        size -= (size_t)sent;
    }
    return 1;
}

static int send_head(int connection, const char* status, const char* type, size_t size) {
    char head[256];
    const int length = snprintf(head, sizeof head,
                                "HTTP/1.1 %s\r\nContent-Type: %s\r\nContent-Length: %zu\r\n"
                                "Cache-Control: no-store\r\nConnection: close\r\n\r\n",
                                status, type, size);
    return send_all(connection, head, (size_t)length);
}

static void refuse(int connection, const char* status, const char* reason) {
    if (send_head(connection, status, "text/plain", strlen(reason)))
        send_all(connection, reason, strlen(reason));
}

static void send_frame(int connection, shown_frame* shown) {
    char line[300];
    size_t facts, vertices;
    pthread_mutex_lock(&shown->mutex);
    /* The age tells that the tracker's thread stands still. */
    facts = (size_t)snprintf(line, sizeof line, "{\"age_ms\": %.0f, %s",
                             (double)(now_ns() - shown->left_ns) * 1e-6, shown->facts);
    vertices = 3 * sizeof(float) * shown->vertex_count;
    if (shown->facts[0] == '\0')
        refuse(connection, "503 Service Unavailable", "no frame yet\n");
    else if (send_head(connection, "200 OK", "application/octet-stream",
                       facts + shown->pixel_bytes + vertices) &&
             send_all(connection, line, facts) &&
             send_all(connection, shown->pixels, shown->pixel_bytes))
        send_all(connection, shown->vertices, vertices);
    pthread_mutex_unlock(&shown->mutex);
}

static void answer(const view_server* server, int connection) {
    char request[4096], page_line[64], frame_line[64], host[64];
    size_t size = 0;
    int has_host;
    request[0] = '\0';
    while (strstr(request, "\r\n\r\n") == NULL && size < sizeof request - 1) {
        const ssize_t got = recv(connection, request + size, sizeof request - 1 - size, 0);
        if (got <= 0) return;
        size += (size_t)got;
        request[size] = '\0';
    }
    snprintf(page_line, sizeof page_line, "GET /%s/ HTTP/1.", server->token);
    snprintf(frame_line, sizeof frame_line, "GET /%s/frame HTTP/1.", server->token);
    snprintf(host, sizeof host, "\r\nHost: 127.0.0.1:%u\r\n", server->port);
    /* Pages of other sites that a browser shows cannot give this host, nor know the token. */
    has_host = strstr(request, host) != NULL;
    if (has_host && strncmp(request, frame_line, strlen(frame_line)) == 0)
        send_frame(connection, server->shown);
    else if (!has_host || strncmp(request, page_line, strlen(page_line)) != 0)
        refuse(connection, "403 Forbidden", "open the address as the program printed it\n");
    else if (send_head(connection, "200 OK", "text/html", sizeof page - 1))
        send_all(connection, page, sizeof page - 1);
}

static void* serve(void* argument) {
    const view_server* server = argument;
    const struct timeval limit = {1, 0};
    for (;;) {
        const int connection = accept(server->listener, NULL, NULL);
        if (connection < 0) return NULL; /* the listener was shut down */
        setsockopt(connection, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
        setsockopt(connection, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
        answer(server, connection);
        close(connection);
    }
}

static void open_server(view_server* server, shown_frame* shown) {
    struct sockaddr_in address;
    socklen_t size = sizeof address;
    unsigned char random[16];
    FILE* source = fopen("/dev/urandom", "rb");
    size_t i;
    if (source == NULL || fread(random, sizeof random, 1, source) != 1) fail("no random numbers");
    fclose(source);
    for (i = 0; i < sizeof random; ++i) snprintf(server->token + 2 * i, 3, "%02x", random[i]);
    memset(&address, 0, sizeof address);
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    server->shown = shown;
    server->listener = socket(AF_INET, SOCK_STREAM, 0);
    if (server->listener < 0 ||
        bind(server->listener, (struct sockaddr*)&address, sizeof address) != 0 ||
        listen(server->listener, 8) != 0 ||
        getsockname(server->listener, (struct sockaddr*)&address, &size) != 0)
        fail("no socket to listen on");
    server->port = ntohs(address.sin_port);
}

/* ---- the loop ---- */

/* Tracks the sequence at the pace of its frames: forth in even rounds, back in odd ones. */
static void track_rounds(const tracking* running, stereo_sequence* sequence, unsigned rounds,
                         shown_frame* shown) {
    const size_t count = frame_count(sequence);
    const int64_t start = now_ns();
    size_t i;
    for (i = 0; i < rounds * count; ++i) {
        const size_t in_round = i % count,
                     number = i / count % 2 == 0 ? in_round : count - 1 - in_round;
        const int64_t due = start + timestamp_of(i);
        const struct timespec until = {(time_t)(due / 1000000000), (long)(due % 1000000000)};
        defrec_job job;
        defrec_result result;
        int64_t submitted;
        read_frame(sequence, number);
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL);
        submitted = now_ns();
        job = track(running, sequence, timestamp_of(i), &result);
        leave(shown, &sequence->left, &result, &running->camera, i, submitted);
        defrec_job_release(job);
    }
}

int main(int argc, char** argv) {
    stereo_sequence sequence;
    shown_frame shown;
    view_server server;
    pthread_t thread;
    unsigned rounds = 0;
    char rest = 0;
    tracking running;
    if (argc < 5 || argc > 6 || sscanf(argv[4], "%u%c", &rounds, &rest) != 1 || rounds < 1) {
        fprintf(stderr, "usage: live_view LEFT RIGHT FX,FY,CX,CY,BASELINE_MM ROUNDS [DEVICE_ID]\n");
        return 2;
    }
    sequence = open_sequence(argv[1], argv[2]);
    running = open_tracking(argv[3], &sequence.left, argc == 6 ? argv[5] : NULL, 0);

    memset(&shown, 0, sizeof shown);
    shown.pixel_bytes = (size_t)3 * sequence.left.width * sequence.left.height;
    shown.pixels = malloc(shown.pixel_bytes);
    if (shown.pixels == NULL) fail("no memory for an image");
    pthread_mutex_init(&shown.mutex, NULL);
    open_server(&server, &shown);
    if (pthread_create(&thread, NULL, serve, &server) != 0) fail("no thread for the server");
    printf("open http://127.0.0.1:%u/%s/\n", server.port, server.token);
    fflush(stdout);

    track_rounds(&running, &sequence, rounds, &shown);

    shutdown(server.listener, SHUT_RDWR);
    pthread_join(thread, NULL);
    close(server.listener);
    close_tracking(&running);
    pthread_mutex_destroy(&shown.mutex);
    free(shown.pixels);
    free(shown.vertices);
    close_sequence(&sequence);
    return 0;
}
