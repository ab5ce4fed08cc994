/* core/clock.h - wall-clock time.      Tier 0, private. */
#ifndef DPH_CORE_CLOCK_H
#define DPH_CORE_CLOCK_H

/* Seconds since some fixed moment, never running backwards. */
double dph_seconds(void);

#endif
