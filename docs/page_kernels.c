/* The functions of numba's runtime that kernels call: memory of arrays. Errors of Python, which
   kernels do not raise, end the program. */
#include <stdint.h>
#include <stdlib.h>

typedef struct { int64_t references; void *destructor, *information, *data; int64_t size; } Memory;

void *NRT_MemInfo_alloc_aligned(int64_t size, int32_t alignment) {
  Memory *memory = malloc(sizeof(Memory) + size + alignment);
  if (!memory) __builtin_trap();
  uintptr_t start = (uintptr_t)(memory + 1);
  start = (start + alignment - 1) / alignment * alignment;
  *memory = (Memory){1, 0, 0, (void *)start, size};
  return memory;
}
void *NRT_MemInfo_alloc(int64_t size) { return NRT_MemInfo_alloc_aligned(size, 16); }
void NRT_MemInfo_call_dtor(void *memory) { free(memory); }
void *NRT_Allocate(int64_t size) { return malloc(size); }
void NRT_Free(void *memory) { free(memory); }
void *take(int32_t size) { return malloc(size); }

void numba_gil_ensure(void *state) {}
void numba_gil_release(void *state) {}
void Py_DecRef(void *object) {}
void PyErr_Clear(void) {}
int32_t PyExc_RuntimeError;

void *NRT_MemInfo_new_varsize_dtor(int64_t size, void *destructor) { __builtin_trap(); }
void *NRT_MemInfo_varsize_realloc(void *memory, int64_t size) { __builtin_trap(); }
void *PyUnicode_FromString(void *text) { __builtin_trap(); }
void *PyBytes_FromStringAndSize(void *text, int64_t size) { __builtin_trap(); }
void PyErr_WriteUnraisable(void *object) { __builtin_trap(); }
void PyErr_SetString(void *kind, void *text) { __builtin_trap(); }
void *numba_unpickle(void *text, int32_t size, void *hash) { __builtin_trap(); }
void *numba_runtime_build_excinfo_struct(void *one, void *other) { __builtin_trap(); }
void numba_do_raise(void *information) { __builtin_trap(); }
