// SPDX-License-Identifier: Apache-2.0
// For LD_PRELOAD: makes one system call on a path in one folder fail, once or from then on.

#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

enum { OPEN, READ, WRITE, CLOSE, SYNC, RENAME, MKDIR, UNLINK, STAT, TRUNCATE, SEEK, LINK, CHMOD, DUP, LOCK, N_CALLS };
enum { SHORT = -1, ZERO = -2, SLOW = -3 };

static char folder[4096];  // "": nothing is counted
static int counts[N_CALLS];
static int failing = -1;  // the call that fails, the error it fails with, and whether all later ones fail too
static int at, failure, forever;

void faults_start(const char* path, int call, int number, int error, int lasting) {
  memset(counts, 0, sizeof counts);
  failing = call;
  at = number;
  failure = error;
  forever = lasting;
  snprintf(folder, sizeof folder, "%s", path);
}

void faults_stop(int* found) {
  folder[0] = 0;
  memcpy(found, counts, sizeof counts);
}

static int in_folder(const char* path) {
  const size_t length = strlen(folder);
  return length && strncmp(path, folder, length) == 0 && (path[length] == '/' || path[length] == 0);
}

static int of_descriptor(int descriptor) {
  if (!folder[0] || descriptor < 0) return 0;
  char link[64], path[4096];
  snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
  const ssize_t length = readlink(link, path, sizeof path - 1);
  if (length < 0) return 0;
  path[length] = 0;
  return in_folder(path);
}

static int of_path(int base, const char* path) {
  if (!folder[0] || !path) return 0;
  return path[0] == '/' ? in_folder(path) : of_descriptor(base);
}

// The error of this call; 0: it does not fail.
static int fails(int call, int ours) {
  if (!ours) return 0;
  const int number = __sync_fetch_and_add(&counts[call], 1);
  if (call != failing || number < at || (number > at && !forever)) return 0;
  return failure;
}

#define REAL(name) __typeof__(name)* real = (__typeof__(name)*)dlsym(RTLD_NEXT, #name)
#define FAIL(call, ours)             \
  const int error = fails(call, ours); \
  if (error > 0) {                   \
    errno = error;                   \
    return -1;                       \
  }
#define MODE                              \
  mode_t mode = 0;                        \
  if (flags & (O_CREAT | __O_TMPFILE)) {  \
    va_list list;                         \
    va_start(list, flags);                \
    mode = va_arg(list, mode_t);          \
    va_end(list);                         \
  }

#define DEFINE_OPEN(name)                                \
  int name(const char* path, int flags, ...) {           \
    MODE REAL(name);                                     \
    FAIL(OPEN, of_path(-1, path)) return real(path, flags, mode); \
  }
#define DEFINE_OPENAT(name)                                   \
  int name(int base, const char* path, int flags, ...) {      \
    MODE REAL(name);                                          \
    FAIL(OPEN, of_path(base, path)) return real(base, path, flags, mode); \
  }
DEFINE_OPEN(open)
DEFINE_OPEN(open64)
DEFINE_OPENAT(openat)
DEFINE_OPENAT(openat64)

FILE* fopen64(const char* path, const char* mode) {
  REAL(fopen64);
  const int error = fails(OPEN, of_path(-1, path));
  if (error > 0) {
    errno = error;
    return NULL;
  }
  return real(path, mode);
}

ssize_t read(int descriptor, void* data, size_t size) {
  REAL(read);
  FAIL(READ, of_descriptor(descriptor)) return real(descriptor, data, error == SHORT ? (size + 1) / 2 : size);
}

static ssize_t part_of(int error, size_t size) { return error == SHORT ? size / 2 : size; }

ssize_t write(int descriptor, const void* data, size_t size) {
  REAL(write);
  FAIL(WRITE, of_descriptor(descriptor)) if (error == ZERO) return 0;
  return real(descriptor, data, part_of(error, size));
}

ssize_t pwrite64(int descriptor, const void* data, size_t size, off64_t place) {
  REAL(pwrite64);
  FAIL(WRITE, of_descriptor(descriptor)) return real(descriptor, data, part_of(error, size), place);
}

ssize_t writev(int descriptor, const struct iovec* parts, int count) {
  REAL(writev);
  FAIL(WRITE, of_descriptor(descriptor)) return real(descriptor, parts, count);
}

// As Linux: the descriptor is closed even if the call fails.
int close(int descriptor) {
  REAL(close);
  const int error = fails(CLOSE, of_descriptor(descriptor));
  const int result = real(descriptor);
  if (error <= 0) return result;
  errno = error;
  return -1;
}

static int sync_of(int descriptor, int (*real)(int)) {
  FAIL(SYNC, of_descriptor(descriptor)) if (error == SLOW) usleep(300000);
  return real(descriptor);
}

int fsync(int descriptor) {
  REAL(fsync);
  return sync_of(descriptor, real);
}

int fdatasync(int descriptor) {
  REAL(fdatasync);
  return sync_of(descriptor, real);
}

#define DEFINE(result, call, ours, name, parameters, ...) \
  result name parameters {                                \
    REAL(name);                                           \
    FAIL(call, ours) return real(__VA_ARGS__);            \
  }
DEFINE(int, RENAME, of_path(-1, to), rename, (const char* from, const char* to), from, to)
DEFINE(int, RENAME, of_path(b, to), renameat, (int a, const char* from, int b, const char* to), a, from, b, to)
DEFINE(int, MKDIR, of_path(-1, path), mkdir, (const char* path, mode_t mode), path, mode)
DEFINE(int, MKDIR, of_path(base, path), mkdirat, (int base, const char* path, mode_t mode), base, path, mode)
DEFINE(int, UNLINK, of_path(-1, path), unlink, (const char* path), path)
DEFINE(int, UNLINK, of_path(base, path), unlinkat, (int base, const char* path, int flags), base, path, flags)
DEFINE(int, UNLINK, of_path(-1, path), rmdir, (const char* path), path)
DEFINE(int, STAT, of_path(-1, path), stat64, (const char* path, struct stat64* found), path, found)
DEFINE(int, STAT, of_path(-1, path), lstat64, (const char* path, struct stat64* found), path, found)
DEFINE(int, STAT, of_descriptor(descriptor), fstat64, (int descriptor, struct stat64* found), descriptor, found)
DEFINE(int, STAT, of_path(base, path), fstatat64, (int base, const char* path, struct stat64* found, int flags), base,
       path, found, flags)
DEFINE(int, STAT, of_path(-1, path), access, (const char* path, int mode), path, mode)
DEFINE(int, TRUNCATE, of_descriptor(descriptor), ftruncate64, (int descriptor, off64_t size), descriptor, size)
DEFINE(off64_t, SEEK, of_descriptor(descriptor), lseek64, (int descriptor, off64_t place, int from), descriptor, place,
       from)
DEFINE(int, LINK, of_path(-1, to), link, (const char* from, const char* to), from, to)
DEFINE(int, LINK, of_path(b, to), linkat, (int a, const char* from, int b, const char* to, int flags), a, from, b, to,
       flags)
DEFINE(int, CHMOD, of_path(-1, path), chmod, (const char* path, mode_t mode), path, mode)
DEFINE(int, CHMOD, of_path(base, path), fchmodat, (int base, const char* path, mode_t mode, int flags), base, path,
       mode, flags)
DEFINE(int, LOCK, of_descriptor(descriptor), flock, (int descriptor, int operation), descriptor, operation)

int fcntl64(int descriptor, int command, ...) {
  REAL(fcntl64);
  va_list list;
  va_start(list, command);
  void* argument = va_arg(list, void*);
  va_end(list);
  if (command == F_DUPFD_CLOEXEC) {
    FAIL(DUP, of_descriptor(descriptor))
  }
  return real(descriptor, command, argument);
}
