# cmake -DINPUT=FILE -DOUTPUT=FILE.c -DSYMBOL=NAME -P embed_text.cmake: a text as a C array with a 0 byte beyond its end, as bytes, so that no
# length of a string literal is exceeded.
file(READ ${INPUT} hex HEX)
string(REGEX REPLACE "(..)" "0x\\1," bytes "${hex}")
string(REGEX REPLACE "(0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,0x..,)" "\\1\n" bytes "${bytes}")
get_filename_component(name ${INPUT} NAME)
file(WRITE ${OUTPUT} "/* Made by cmake/embed_text.cmake from ${name}. */
extern const char ${SYMBOL}[];
const char ${SYMBOL}[] = {${bytes}0};
")
