/* core/clock.h - wall-clock time, and what else the machine does.      Tier 0, private. */
#ifndef DPH_CORE_CLOCK_H
#define DPH_CORE_CLOCK_H

/* Seconds since some fixed moment, never running backwards. */
double dph_seconds(void);

/* Seconds of processors that were not idle and did not work for this process, since some fixed
 * moment, to some hundredths; 0 where the system does not say. */
double dph_seconds_others(void);

#endif
