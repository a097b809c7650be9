/* tests/memory/starve.cpp: see starve.h. */
#include "tests/memory/starve.h"

#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <new>

#include <jansson.h>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define REPLACES_MALLOC 0
#else
#define REPLACES_MALLOC 1
extern "C" { /* the allocator of glibc under its other names */
void *__libc_malloc(std::size_t size);
void *__libc_calloc(std::size_t count, std::size_t size);
void *__libc_realloc(void *memory, std::size_t size);
void *__libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void *memory);
}
#endif

namespace {

struct counts {
    bool active, lasting;
    starve_kind kind;
    long fail_at, asked, alive[2];
};
__thread counts now;

bool refuses(starve_kind kind) {
    if (!now.active || now.kind != kind) return false;
    ++now.asked;
    if (!now.fail_at || now.asked < now.fail_at || (now.asked > now.fail_at && !now.lasting)) return false;
    errno = ENOMEM;
    return true;
}

void *count(starve_kind kind, void *memory) {
    if (memory) ++now.alive[kind];
    return memory;
}

void *hook_allocate(void *, std::size_t size) {
    if (refuses(STARVE_HOOK)) return nullptr;
#if REPLACES_MALLOC
    return count(STARVE_HOOK, __libc_memalign(64, size));
#else
    return count(STARVE_HOOK, aligned_alloc(64, size));
#endif
}

void hook_release(void *, void *memory) {
    --now.alive[STARVE_HOOK];
#if REPLACES_MALLOC
    __libc_free(memory);
#else
    free(memory);
#endif
}

} // namespace

#if REPLACES_MALLOC
extern "C" {

void *malloc(std::size_t size) {
    return refuses(STARVE_SYSTEM) ? nullptr : count(STARVE_SYSTEM, __libc_malloc(size));
}

void *calloc(std::size_t number, std::size_t size) {
    return refuses(STARVE_SYSTEM) ? nullptr : count(STARVE_SYSTEM, __libc_calloc(number, size));
}

void *realloc(void *memory, std::size_t size) {
    if (!memory) return malloc(size);
    return refuses(STARVE_SYSTEM) ? nullptr : __libc_realloc(memory, size);
}

void *memalign(std::size_t alignment, std::size_t size) {
    return refuses(STARVE_SYSTEM) ? nullptr : count(STARVE_SYSTEM, __libc_memalign(alignment, size));
}

void *aligned_alloc(std::size_t alignment, std::size_t size) {
    return memalign(alignment, size);
}

int posix_memalign(void **out, std::size_t alignment, std::size_t size) {
    void *memory = memalign(alignment, size);
    if (!memory) return ENOMEM;
    *out = memory;
    return 0;
}

void free(void *memory) {
    if (memory) --now.alive[STARVE_SYSTEM];
    __libc_free(memory);
}

} // extern "C"
#else
namespace {

void *system_allocate(std::size_t size) {
    return refuses(STARVE_SYSTEM) ? nullptr : count(STARVE_SYSTEM, malloc(size));
}

void system_release(void *memory) {
    if (memory) --now.alive[STARVE_SYSTEM];
    free(memory);
}

} // namespace

void *operator new(std::size_t size) {
    void *memory = system_allocate(size);
    if (!memory) throw std::bad_alloc();
    return memory;
}
void operator delete(void *memory) noexcept {
    system_release(memory);
}
void operator delete(void *memory, std::size_t) noexcept {
    system_release(memory);
}
#endif

void starve_set(starve_kind kind, long n, bool lasting) {
#if !REPLACES_MALLOC
    json_set_alloc_funcs(system_allocate, system_release);
#endif
    now.kind = kind, now.fail_at = n, now.asked = 0, now.active = false, now.lasting = lasting;
}

void starve_begin(void) {
    now.active = true;
}

void starve_end(void) {
    now.active = false;
}

bool starve_failed(void) {
    return now.asked >= now.fail_at;
}

long starve_alive(void) {
    return now.alive[now.kind];
}

fct_env starve_env(void) {
    fct_env env = fct_env_default();
    env.allocate = hook_allocate;
    env.release = hook_release;
    return env;
}
