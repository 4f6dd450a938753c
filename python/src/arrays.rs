//! NumPy arrays that are filled in one pass, without a Python object for each element.

use numpy::{Element, PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;

/// An array of shape (n,).
pub(crate) fn column<'py, T: Element + Copy>(
    py: Python<'py>,
    values: impl ExactSizeIterator<Item = T>,
) -> Bound<'py, PyArray1<T>> {
    // SAFETY: every element is written before anything else sees the array, to which this is the only reference.
    unsafe {
        let array = PyArray1::new(py, values.len(), false);
        fill(array.as_slice_mut(), values);
        array
    }
}

/// An array of shape (n, N).
pub(crate) fn rows<'py, const N: usize>(
    py: Python<'py>,
    values: impl ExactSizeIterator<Item = [f64; N]>,
) -> Bound<'py, PyArray2<f64>> {
    // SAFETY: as in `column`; the slice has N elements for each row.
    unsafe {
        let array = PyArray2::new(py, [values.len(), N], false);
        if let Ok(slice) = array.as_slice_mut() {
            for (row, value) in slice.chunks_exact_mut(N).zip(values) {
                row.copy_from_slice(&value);
            }
        }
        array
    }
}

/// An array of shape (rows, columns) from all of its elements, row by row.
pub(crate) fn table<'py, T: Element + Copy>(
    py: Python<'py>,
    values: &[T],
    shape: [usize; 2],
) -> PyResult<Bound<'py, PyArray2<T>>> {
    PyArray1::from_slice(py, values).reshape(shape)
}

/// An array of shape (rows, columns, 2) from all of its elements, row by row.
pub(crate) fn pairs<'py>(
    py: Python<'py>,
    values: &[[f64; 2]],
    shape: [usize; 2],
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    PyArray1::from_slice(py, values.as_flattened()).reshape([shape[0], shape[1], 2])
}

fn fill<T: Copy, E>(slice: Result<&mut [T], E>, values: impl Iterator<Item = T>) {
    if let Ok(slice) = slice {
        slice.iter_mut().zip(values).for_each(|(place, value)| *place = value);
    }
}
