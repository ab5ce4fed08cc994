# cmake -DOUTPUT=FILE.c -DFILES=a;b -P embed.cmake: writes the shaders into one C file, as bytes, so that no length of a string literal is
# exceeded. The public include is a symbol of its own.
set(table "")
set(arrays "")
foreach(file ${FILES})
  get_filename_component(name ${file} NAME)
  string(MAKE_C_IDENTIFIER ${name} symbol)
  file(READ ${file} hex HEX)
  string(REGEX REPLACE "(..)" "0x\\1," bytes "${hex}")
  string(REGEX REPLACE "(0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,)" "\\1\n" bytes "${bytes}")
  if(name STREQUAL "diaphan.glsl")
    set(symbol dph_shader_include)
    string(APPEND arrays "const char ${symbol}[] = {${bytes}0};\n")
  else()
    string(APPEND arrays "static const char ${symbol}[] = {${bytes}0};\n")
  endif()
  string(APPEND table "    {\"${name}\", ${symbol}},\n")
endforeach()
file(WRITE ${OUTPUT} "/* Made by cmake/embed.cmake from shaders/. */
#include \"render/shaders.h\"

#include <diaphan/render.h>

${arrays}
const struct dph_shader_file dph_shader_files[] = {
${table}    {0, 0},
};
")
