/* Preloaded: writes down every call on files below FAULT_BELOW, and lets the FAULT_AT-th fail with
 * FAULT_ERRNO. The records of 256 bytes in FAULT_TRACE are the counter for all processes of a run.
 * With FAULT_STAYS that call writes one half, and all later ones that write fail, as on a full disk. */
#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define REAL(call) ((__typeof__(&call))dlsym(RTLD_NEXT, #call))
enum { GOES_ON, FAILS, IS_CUT };

static int fate(const char *call, const char *path, int writes) {
    const char *below = getenv("FAULT_BELOW"), *trace = getenv("FAULT_TRACE");
    char record[257];
    int was = errno, stays = getenv("FAULT_STAYS") != NULL;
    if (!below || !trace || strncmp(path, below, strlen(below)) || !strcmp(path, trace)) return GOES_ON;
    snprintf(record, sizeof record, "%-9s %-245.245s\n", call, path + strlen(below));
    int file = REAL(open)(trace, O_WRONLY | O_APPEND | O_CLOEXEC);
    if (file < 0 || REAL(write)(file, record, 256) != 256) abort();
    long n = lseek(file, 0, SEEK_CUR) / 256, at = atol(getenv("FAULT_AT"));
    close(file);
    errno = was;
    if (n != at && !(at > 0 && n > at && writes && stays)) return GOES_ON;
    errno = atoi(getenv("FAULT_ERRNO"));
    return n == at && stays ? IS_CUT : FAILS;
}

static int fate_of(const char *call, int file, int writes) {
    char link[32], path[4096] = "";
    snprintf(link, sizeof link, "/proc/self/fd/%d", file);
    ssize_t length = readlink(link, path, sizeof path - 1);
    return length > 0 ? fate(call, path, writes) : GOES_ON;
}

#define OPENING(name)                                                            \
    int name(const char *path, int flags, ...) {                                 \
        __builtin_va_list rest; __builtin_va_start(rest, flags);                 \
        int mode = flags & O_CREAT ? __builtin_va_arg(rest, int) : 0;            \
        return fate("open", path, flags & O_CREAT) ? -1 : REAL(name)(path, flags, mode); }
#define ON_FILE(name, writes, kind, at, ...)                                     \
    ssize_t name(int file, kind buffer, size_t size __VA_ARGS__) {               \
        int is = fate_of(#name, file, writes);                                   \
        if (is == IS_CUT && writes && size > 1) return REAL(name)(file, buffer, size / 2 at); \
        return is ? -1 : REAL(name)(file, buffer, size at); }
#define COMMA ,
OPENING(open) OPENING(open64)
ON_FILE(read, 0, void *, )
ON_FILE(pread, 0, void *, COMMA where, , off_t where)
ON_FILE(pread64, 0, void *, COMMA where, , off64_t where)
ON_FILE(write, 1, const void *, )
ON_FILE(pwrite, 1, const void *, COMMA where, , off_t where)
ON_FILE(pwrite64, 1, const void *, COMMA where, , off64_t where)
int fsync(int file) { return fate_of("fsync", file, 1) ? -1 : REAL(fsync)(file); }
int unlink(const char *path) { return fate("unlink", path, 0) ? -1 : REAL(unlink)(path); }
int mkdir(const char *path, mode_t mode) { return fate("mkdir", path, 1) ? -1 : REAL(mkdir)(path, mode); }
int rename(const char *from, const char *to) { return fate("rename", to, 1) ? -1 : REAL(rename)(from, to); }
DIR *opendir(const char *path) { return fate("opendir", path, 0) ? NULL : REAL(opendir)(path); }
FILE *fopen64(const char *path, const char *mode) { return fate("open", path, *mode != 'r') ? NULL : REAL(fopen64)(path, mode); }
