// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/rank_group.h"

#include <memory>

namespace semfoam {

// Joins the processes that mpirun, or another launcher of MPI, has started with this one; without a
// launcher, the process is the only rank. Must be called once, from the thread that makes all later
// calls, after HandleInterruptions(). Throws FieldError for the field "mpi" where this program was
// built without MPI (SEMFOAM_MPI).
//
// A rank that has ended without a word is noticed by rank 0 alone, by an error of the connection,
// or where it does not answer when the launcher has begun to end the job, which it does with
// SIGCONT (Open MPI) and SIGTERM. The other ranks wait for rank 0, or for the launcher to end them.
// A job that was suspended and continued may be taken for one that ends, where ranks continue at
// different times.
std::unique_ptr<RankGroup> JoinMpiRanks();

}  // namespace semfoam
