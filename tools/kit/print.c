/* tools/kit/print.c: an answer as JSON for programs or as aligned lines for people. */
#include "tools/kit/tool.h"

#include <string.h>

static void print_value(const json_t *value) {
    if (json_is_string(value)) {
        fputs(json_string_value(value), stdout);
    } else if (json_is_boolean(value)) {
        fputs(json_is_true(value) ? "yes" : "no", stdout);
    } else if (json_is_integer(value)) {
        printf("%" JSON_INTEGER_FORMAT, json_integer_value(value));
    } else if (json_is_real(value)) {
        printf("%.6g", json_real_value(value));
    } else {
        size_t i;
        json_t *item;
        json_array_foreach(value, i, item) {
            if (i) putchar(' ');
            if (json_is_number(item)) printf("%.6g", json_number_value(item));
        }
    }
}

/* Lines of one object; those of an object in it are told by "outer inner". Objects nest no deeper. */
static void print_lines(json_t *object) {
    const char *key, *inner;
    json_t *value, *inner_value;
    json_object_foreach(object, key, value) {
        if (!json_is_object(value)) {
            printf("%-24s", key);
            print_value(value);
            putchar('\n');
            continue;
        }
        json_object_foreach(value, inner, inner_value) {
            int used = printf("%s %s", key, inner);
            printf("%*s", used < 24 ? 24 - used : 1, "");
            print_value(inner_value);
            putchar('\n');
        }
    }
}

int tool_print(tool *t, json_t *object) {
    if (!t->json && object) print_lines(object);
    return tool_json(t, object);
}
