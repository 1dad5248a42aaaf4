//! Products on every instruction set against a naive product in f64.

use proptest::prelude::*;

use super::*;

proptest! {
    #[test]
    fn products_agree_with_the_naive_product(m in 0usize..20, k in 0usize..20, n in 0usize..40) {
        let a: Vec<f32> = (0..m * k).map(|i| (i % 7) as f32 - 3.0).collect();
        let b: Vec<f32> = (0..k * n).map(|i| (i % 5) as f32 - 2.0).collect();
        let mut c = vec![1.0f32; m * n];
        product_packed(Mat::new(&a, m, k), &Packed::new(Mat::new(&b, k, n)), MatMut::new(&mut c, m, n), true);
        for i in 0..m {
            for j in 0..n {
                let sum: f32 = (0..k).map(|p| a[i * k + p] * b[p * n + j]).sum();
                prop_assert_eq!(c[i * n + j], sum + 1.0);
            }
        }
    }
}
