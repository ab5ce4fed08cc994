/* render/shaders.h - the files of shaders/, embedded at build time.      Tier 3, private. */
#ifndef DPH_RENDER_SHADERS_H
#define DPH_RENDER_SHADERS_H

struct dph_shader_file {
    const char *name; /* "shsss.frag"; NULL ends the table */
    const char *text;
};

extern const struct dph_shader_file dph_shader_files[];

#endif
