/* Counts the system calls that change a file, and ends the process before one of them; loaded with LD_PRELOAD.
 *
 * die_before(n, torn) arms it: the n-th call from now on (1 is the next) does not happen, the process is killed instead.
 * With torn, a write does happen, but only so many 1024ths of it: what a disk may hold after a loss of power.
 * changes() is how many calls there were. Unarmed, it only counts. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <signal.h>
#include <stdatomic.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

static atomic_long counted, fatal;
static atomic_int tearing;

void die_before(long nth, int torn) {
    atomic_store(&tearing, torn);
    atomic_store(&fatal, nth ? atomic_load(&counted) + nth : 0);
}

long changes(void) { return atomic_load(&counted); }

/* Whether this call is the last of the process. */
static int last(void) {
    long number = atomic_fetch_add(&counted, 1) + 1, nth = atomic_load(&fatal);
    return nth && number >= nth;
}

static void die(void) {
    kill(getpid(), SIGKILL);
    for (;;) pause();
}

#define NEXT(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

ssize_t write(int fd, const void *data, size_t size) {
    static __typeof__(&write) next;
    if (!next) next = NEXT(write);
    if (last()) {
        if (atomic_load(&tearing) && size > 1) (void)!next(fd, data, size * atomic_load(&tearing) / 1024);
        die();
    }
    return next(fd, data, size);
}

ssize_t pwrite(int fd, const void *data, size_t size, off_t offset) {
    static __typeof__(&pwrite) next;
    if (!next) next = NEXT(pwrite);
    if (last()) {
        if (atomic_load(&tearing) && size > 1) (void)!next(fd, data, size * atomic_load(&tearing) / 1024, offset);
        die();
    }
    return next(fd, data, size, offset);
}

ssize_t pwrite64(int fd, const void *data, size_t size, off64_t offset) { return pwrite(fd, data, size, offset); }

#define CHANGE(type, name, declared, passed)    \
    type name declared {                        \
        static __typeof__(&name) next;          \
        if (!next) next = NEXT(name);           \
        if (last()) die();                      \
        return next passed;                     \
    }

CHANGE(int, fsync, (int fd), (fd))
CHANGE(int, fdatasync, (int fd), (fd))
CHANGE(int, ftruncate, (int fd, off_t size), (fd, size))
CHANGE(int, ftruncate64, (int fd, off64_t size), (fd, size))
CHANGE(int, rename, (const char *from, const char *to), (from, to))
CHANGE(int, link, (const char *from, const char *to), (from, to))
CHANGE(int, unlink, (const char *path), (path))
CHANGE(int, mkdir, (const char *path, mode_t mode), (path, mode))
CHANGE(int, rmdir, (const char *path), (path))
CHANGE(ssize_t, sendfile, (int to, int from, off_t *offset, size_t size), (to, from, offset, size))
CHANGE(ssize_t, copy_file_range, (int from, off64_t *begin, int to, off64_t *at, size_t size, unsigned flags),
       (from, begin, to, at, size, flags))
