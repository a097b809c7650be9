/* tools/guard/signals.h: the end of the process by a signal, and its standard streams.
 *
 * The first SIGHUP, SIGINT or SIGTERM cancels the library call and lets the command clean up. A second one,
 * or GRACE milliseconds, ends the process at once. A command may do without the limit of time. In both cases
 * the process removes its temporary files and dies of the signal, so that the exit status is 128 + signal for
 * a shell.
 */
#ifndef FCT_TOOLS_GUARD_SIGNALS_H
#define FCT_TOOLS_GUARD_SIGNALS_H

#include "tools/guard/inputs.h"

/* Opens /dev/null for each of the descriptors 0 to 2 that is closed, so that no other file gets its number.
 * Reads and writes of the descriptors 0 and 1 then fail. */
void guard_open_streams(void);
/* Whether standard output was closed when the program began. */
bool guard_stdout_was_closed(void);

/* Installs the handlers. A signal that the parent ignores stays ignored, as nohup needs. A mapped input that
 * another program shortens (SIGBUS) ends the process with `exit_code`; the message names the file of
 * `inputs`, which must live as long as the process. */
void guard_install_signals(const char *program, const guard_inputs *inputs, int exit_code);
/* Notes that temporary files may lie in the folder of `path`. The first FOLDERS different folders count. */
void guard_note_output(const char *path);
/* The first signal, or 0. */
int guard_signal(void);
/* Lets a first SIGINT or SIGTERM end the run without a limit of time, so that it can write what it has. */
void guard_end_softly(void);
/* Ends the process by the signal. */
void guard_die(int signal_number);

#endif
