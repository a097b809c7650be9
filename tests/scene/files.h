/* tests/scene/files.h: a folder for the files of a test. */
#ifndef FCT_TESTS_SCENE_FILES_H
#define FCT_TESTS_SCENE_FILES_H

#include <unistd.h>

#include "support.h"

static char folder[] = "/tmp/facetree-scene-XXXXXX";

/* The path of a file of the folder. The last four results are valid. */
static inline const char *path_of(const char *name) {
    static char path[4][256];
    static int turn;
    char *to = path[turn++ % 4];
    snprintf(to, sizeof path[0], "%s/%s", folder, name);
    return to;
}

static inline void write_bytes(const char *name, const void *data, size_t size) {
    FILE *file = fopen(path_of(name), "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(data, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

static inline void write_text(const char *name, const char *text) {
    write_bytes(name, text, strlen(text));
}

static inline int remove_folder(void **unused) {
    (void)unused;
    char command[256];
    snprintf(command, sizeof command, "rm -r %s", folder);
    return system(command);
}

#endif
