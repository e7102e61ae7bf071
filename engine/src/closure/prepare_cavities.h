// Cheap repairs before anything is filled: loose cells go, faces just below the hull go up to it.
#pragma once

#include "closure/working_mesh.h"
#include "input/hull.h"

namespace amhex {

// Removes cells that hang on at most one neighbour and small groups without connection, which only
// obstruct the filling. Returns how many.
int RemoveLooseCells(WorkingMesh* mesh);

// Declares open faces near the hull to be hull faces and moves their vertices onto it, nearest
// first, if all cells there stay good. Returns how many.
int SnapFacesToHull(const Hull& hull, WorkingMesh* mesh);

// Declares cavities of no depth to be hull: those of which every face spans hull vertices and lies
// on the hull or a little below. Returns how many faces.
int DeclareHullFaces(const Hull& hull, WorkingMesh* mesh);

}  // namespace amhex
