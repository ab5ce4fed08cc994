/* diaphan - directional thickness of meshes, and translucent pictures of them. The table of
 * commands. */
#define _POSIX_C_SOURCE 200809L
#include "cli.h"

#include <signal.h>
#include <string.h>

static const struct command *const commands[] = {
    &command_bake,   &command_render, &command_compare, &command_fit, &command_info,
    &command_candle, &command_bench,  NULL,
};

static const struct command *find(const char *name)
{
    for (size_t i = 0; commands[i]; i++)
        if (strcmp(commands[i]->name, name) == 0)
            return commands[i];
    return NULL;
}

static const char *command_name(size_t i, const void *user)
{
    (void)user;
    return commands[i] ? commands[i]->name : NULL;
}

static void print_help(FILE *stream)
{
    fprintf(stream,
            "diaphan bakes how thick a mesh is in every direction and draws it translucent.\n\n"
            "Examples:\n"
            "  diaphan candle -o candle.glb               write the candle mesh\n"
            "  diaphan bake bunny.obj -o bunny.glb        bake a mesh, once\n"
            "  diaphan render bunny.glb -o bunny.png      draw it with the light behind\n\n"
            "Commands:\n");
    for (size_t i = 0; commands[i]; i++)
        fprintf(stream, "  %-8s %s\n", commands[i]->name, commands[i]->summary);
    fprintf(stream,
            "\ndiaphan help COMMAND says more. Meshes are .glb, .gltf, .obj, .ply or .stl.\n");
}

static int unknown_command(const char *name)
{
    const char *near = nearest_name(name, command_name, NULL);
    if (near)
        complain(NULL, "unknown command '%s'; did you mean %s?", name, near);
    else
        complain(NULL, "unknown command '%s'; see diaphan --help", name);
    return EXIT_USAGE;
}

int main(int argc, char **argv)
{
    if (argc < 2) {
        print_help(stderr);
        return EXIT_USAGE;
    }
    signal(SIGXFSZ, SIG_IGN); /* a file that may not grow is an error to report, not a death */
    static struct settings settings;
    const char *word = argv[1];
    bool help = strcmp(word, "help") == 0;
    if ((help && argc == 2) || strcmp(word, "--help") == 0 || strcmp(word, "-h") == 0) {
        print_help(stdout);
        return finish_stdout(&settings, EXIT_DONE);
    }
    if (strcmp(word, "--version") == 0) {
        printf("diaphan %s\n", dph_version());
        return finish_stdout(&settings, EXIT_DONE);
    }
    if (help)
        word = argv[2];
    const struct command *command = find(word);
    if (!command)
        return unknown_command(word);
    settings_init(&settings, command);
    if (help)
        settings.help = true;
    else if (!settings_parse(&settings, argc, argv, 2))
        return EXIT_USAGE;
    if (settings.help)
        print_command_help(command);
    else if (settings.version)
        printf("diaphan %s\n", dph_version());
    else
        return finish_stdout(&settings, command->run(&settings));
    return finish_stdout(&settings, EXIT_DONE);
}
