# SPDX-License-Identifier: GPL-3.0-or-later
#
# Modules that run with glibc 2.28, Blender's own minimum, though they are linked on a newer system.
#
# The linker takes the newest version of each function that the system has. glibc keeps the older
# ones; --wrap and oldest_glibc.cpp.in lead to those. What is not in the lists and is newer than 2.28
# makes ./dev package fail, which names the version (devtools/package.py).

set(since_2_2_5
  __pthread_key_create exp exp2 hypot hypotf log log2 pow
  dladdr dlclose dlerror dlopen dlsym
  pthread_attr_getstack pthread_attr_setstacksize pthread_cancel
  pthread_create pthread_detach
  pthread_getattr_np pthread_getspecific pthread_join pthread_key_create pthread_key_delete
  pthread_mutex_trylock pthread_once pthread_rwlock_rdlock pthread_rwlock_unlock
  pthread_rwlock_wrlock pthread_setspecific pthread_sigmask sem_destroy sem_init sem_post sem_wait)
set(since_2_3_3 pthread_condattr_setclock)
set(since_2_3_4 pthread_getaffinity_np pthread_setaffinity_np)
set(written_here arc4random fstat fstat64 lstat lstat64 stat stat64)

set(SELENITE_OLD_FUNCTIONS)
set(wrapped ${written_here})
foreach(version IN ITEMS 2.2.5 2.3.3 2.3.4)
  string(REPLACE . _ list since_${version})
  foreach(name IN LISTS ${list})
    string(APPEND SELENITE_OLD_FUNCTIONS "OLD(${name}, \"GLIBC_${version}\")\n")
    list(APPEND wrapped ${name})
  endforeach()
endforeach()
set(oldest_glibc_source "${PROJECT_BINARY_DIR}/oldest_glibc.cpp")
configure_file(cmake/oldest_glibc.cpp.in "${oldest_glibc_source}" @ONLY)

# selenite_oldest_glibc(TARGET): for a shared object.
function(selenite_oldest_glibc target)
  target_sources(${target} PRIVATE "${oldest_glibc_source}")
  list(TRANSFORM wrapped PREPEND -Wl,--wrap=)
  # Of an older glibc the threads and the loader are libraries of their own.
  target_link_options(${target} PRIVATE ${wrapped}
    -Wl,--push-state,--no-as-needed -l:libpthread.so.0 -l:libdl.so.2 -Wl,--pop-state)
endfunction()
