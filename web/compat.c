/* Functions that Rust's standard library expects of WASI's C library, and Debian's older one lacks. No threads or modes of
 * files here; rustup's target brings a newer library, and needs none of this. */
#include <errno.h>

int *__errno_location(void) { return &errno; }
int fchmod(int file, unsigned mode) { return (void)file, (void)mode, 0; }
int pthread_attr_init(void *attributes) { return (void)attributes, 0; }
int pthread_attr_destroy(void *attributes) { return (void)attributes, 0; }
int pthread_attr_setstacksize(void *attributes, unsigned long size) { return (void)attributes, (void)size, 0; }
int pthread_create(void *thread, const void *attributes, void *(*start)(void *), void *argument) {
    return (void)thread, (void)attributes, (void)start, (void)argument, ENOTSUP;
}
int pthread_detach(void *thread) { return (void)thread, ENOTSUP; }
