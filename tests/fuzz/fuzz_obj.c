/* libFuzzer target: the OBJ reader. */
#include "fuzz_reader.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    return fuzz_reader(dph_read_obj, data, size);
}
