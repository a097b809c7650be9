/* tools/commands.h: the subcommands of `facetree`, one per file. Each runs with its own arguments and returns
 * an exit code. */
#ifndef FCT_TOOLS_COMMANDS_H
#define FCT_TOOLS_COMMANDS_H

int tool_bake(int argc, char **argv);
int tool_boxes(int argc, char **argv);
int tool_closest(int argc, char **argv);
int tool_cluster(int argc, char **argv);
int tool_collide(int argc, char **argv);
int tool_convert(int argc, char **argv);
int tool_compare(int argc, char **argv);
int tool_info(int argc, char **argv);
int tool_level(int argc, char **argv);
int tool_make(int argc, char **argv);
int tool_meshlets(int argc, char **argv);
int tool_partition(int argc, char **argv);
int tool_raycast(int argc, char **argv);
int tool_render(int argc, char **argv);
int tool_simplify(int argc, char **argv);

#endif
