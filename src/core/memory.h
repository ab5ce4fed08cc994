/* core/memory.h - allocations whose size is a product.      Tier 0, private. */
#ifndef DPH_CORE_MEMORY_H
#define DPH_CORE_MEMORY_H

#include <stddef.h>

/* malloc of count * size bytes, NULL also where the product overflows. A count of 0 gives a unique pointer. */
void *dph_alloc(size_t count, size_t size);

/* The same, zeroed. */
void *dph_alloc_zero(size_t count, size_t size);

/* The same, aligned to 64 bytes and padded to a multiple of 64; released by free(). */
void *dph_alloc_aligned(size_t count, size_t size);

/* Makes room for one more element in a growing array: returns `array` or a larger copy of it, and updates *capacity; NULL: out of
 * memory, the array is as before. */
void *dph_grow(void *array, size_t count, size_t *capacity, size_t size);

/* A copy of a string; NULL: out of memory. */
char *dph_strdup(const char *text);

#endif
