/* tools/guard/signals.c: see signals.h. The handlers call only functions that are safe in handlers. */
#define _GNU_SOURCE
#include "tools/guard/signals.h"

#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/time.h>
#include <unistd.h>

#include "facetree/base.h"

enum { GRACE = 300, FOLDERS = 8 }; /* GRACE: milliseconds */

static volatile sig_atomic_t received, soft;
static char folders[FOLDERS][PATH_MAX];
static volatile sig_atomic_t folder_count;
static const char *program_name = "facetree";
static const guard_inputs *program_inputs;
static int shortened_code;
static bool stdout_closed;

void guard_open_streams(void) {
    static const int modes[3] = {O_WRONLY, O_RDONLY, O_RDWR};
    for (int i = 0; i < 3; ++i) {
        if (fcntl(i, F_GETFD) >= 0) continue;
        if (open("/dev/null", modes[i]) != i) _exit(70);
        if (i == STDOUT_FILENO) stdout_closed = true;
    }
}

bool guard_stdout_was_closed(void) {
    return stdout_closed;
}

static void remove_temporaries(void) {
    for (int i = 0; i < folder_count; ++i) fct_temporary_remove(folders[i]);
}

void guard_die(int signal_number) {
    remove_temporaries();
    signal(signal_number, SIG_DFL);
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, signal_number);
    raise(signal_number);
    pthread_sigmask(SIG_UNBLOCK, &set, NULL);
    _exit(128 + signal_number);
}

static void note_signal(int signal_number) {
    if (received) guard_die(received);
    received = signal_number;
    if (soft && signal_number != SIGHUP) return;
    const struct itimerval timer = {.it_value = {.tv_usec = 1000 * GRACE}};
    setitimer(ITIMER_REAL, &timer, NULL);
}

static void end_grace(int signal_number) {
    guard_die(received ? received : signal_number);
}

static void write_text(const char *text) {
    (void)!write(STDERR_FILENO, text, strlen(text));
}

static void end_shortened(int signal_number) {
    const char *path = program_inputs ? guard_find_shortened(program_inputs) : NULL;
    if (!path) guard_die(signal_number);
    remove_temporaries();
    write_text(program_name);
    write_text(": ");
    write_text(path);
    write_text(": was shortened while it was read\n");
    _exit(shortened_code);
}

static void install_handler(int signal_number, void (*handler)(int)) {
    struct sigaction action = {.sa_handler = handler}, old;
    if (sigaction(signal_number, NULL, &old) || old.sa_handler == SIG_IGN) return;
    sigaction(signal_number, &action, NULL);
}

void guard_install_signals(const char *program, const guard_inputs *inputs, int exit_code) {
    program_name = program;
    program_inputs = inputs;
    shortened_code = exit_code;
    install_handler(SIGHUP, note_signal);
    install_handler(SIGINT, note_signal);
    install_handler(SIGTERM, note_signal);
    signal(SIGALRM, end_grace);
    install_handler(SIGBUS, end_shortened);
    signal(SIGPIPE, SIG_IGN);
}

void guard_note_output(const char *path) {
    const char *slash = strrchr(path, '/');
    int length = slash == path ? 1 : slash ? (int)(slash - path) : 0;
    if (folder_count == FOLDERS) return;
    char *folder = folders[folder_count];
    if (snprintf(folder, PATH_MAX, "%.*s", length ? length : 1, length ? path : ".") >= PATH_MAX) return;
    for (int i = 0; i < folder_count; ++i)
        if (strcmp(folders[i], folder) == 0) return;
    ++folder_count;
}

void guard_end_softly(void) {
    soft = 1;
}

int guard_signal(void) {
    return received;
}
