/* Allocations whose size is a product. */
#include "core/memory.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

void *dph_alloc(size_t count, size_t size)
{
    if (size && count > PTRDIFF_MAX / size)
        return NULL;
    return malloc(count && size ? count * size : 1);
}

void *dph_alloc_zero(size_t count, size_t size)
{
    if (size && count > PTRDIFF_MAX / size)
        return NULL;
    return calloc(count ? count : 1, size ? size : 1);
}

void *dph_alloc_aligned(size_t count, size_t size)
{
    if (size && count > (PTRDIFF_MAX - 64) / size)
        return NULL;
    size_t bytes = (count * size + 63) & ~(size_t)63;
    return aligned_alloc(64, bytes ? bytes : 64);
}

void *dph_grow(void *array, size_t count, size_t *capacity, size_t size)
{
    if (count < *capacity)
        return array;
    size_t wanted = *capacity ? *capacity * 2 : 16;
    if (wanted < *capacity || wanted > PTRDIFF_MAX / size)
        return NULL;
    void *larger = realloc(array, wanted * size);
    if (larger)
        *capacity = wanted;
    return larger;
}

char *dph_strdup(const char *text)
{
    size_t bytes = strlen(text) + 1;
    char *copy = malloc(bytes);
    if (copy)
        memcpy(copy, text, bytes);
    return copy;
}
