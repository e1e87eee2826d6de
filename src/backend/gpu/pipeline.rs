//! A compiled kernel with its reflection: bindings by name, access, workgroup size.

use naga::{AddressSpace, Module, StorageAccess};
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor, BindGroupLayoutEntry,
    BindingResource, BindingType, Buffer, BufferBinding, BufferBindingType, BufferSize, ComputePipeline,
    ComputePipelineDescriptor, Device, PipelineCompilationOptions, PipelineLayoutDescriptor, ShaderModuleDescriptor,
    ShaderSource, ShaderStages,
};

use crate::kernels::Kernel;

/// A variable of a kernel to which a buffer is bound.
#[derive(Debug)]
struct Variable {
    name: String,
    binding: u32,
    /// Bytes of the parameter struct of a dispatch, which has a dynamic offset; `None` for an
    /// array.
    parameters: Option<u64>,
    read_only: bool,
}

/// A part of a buffer.
#[derive(Clone, Copy)]
pub(super) struct Window<'a> {
    pub(super) buffer: &'a Buffer,
    /// First byte, a multiple of 256.
    pub(super) first: u64,
    /// Number of bytes.
    pub(super) bytes: u64,
}

/// A compiled kernel.
#[derive(Debug)]
pub(super) struct Pipeline {
    pub(super) pipeline: ComputePipeline,
    pub(super) workgroup_size: u32,
    layout: BindGroupLayout,
    variables: Vec<Variable>,
}

impl Pipeline {
    /// Compiles a kernel. Errors of wgpu go to the caller's error scopes.
    ///
    /// # Errors
    /// A message: the WGSL text is not valid, or the entry point is not as expected.
    pub(super) fn new(device: &Device, kernel: &Kernel) -> Result<Self, String> {
        let label = Some(kernel.name);
        let module = naga::front::wgsl::parse_str(kernel.source)
            .map_err(|error| error.emit_to_string_with_path(kernel.source, kernel.name))?;
        let entry_point = module.entry_points.iter().find(|entry| entry.name == kernel.name);
        let [x, 1, 1] = entry_point.ok_or_else(|| format!("kernel {0} has no entry {0}", kernel.name))?.workgroup_size
        else {
            return Err(format!("the workgroups of kernel {} are not one-dimensional", kernel.name));
        };
        let variables = variables(&module);
        let entries: Vec<_> = variables.iter().map(Variable::layout).collect();
        let layout = device.create_bind_group_layout(&BindGroupLayoutDescriptor { label, entries: &entries });
        let pipeline_layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
            label,
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let shader = device
            .create_shader_module(ShaderModuleDescriptor { label, source: ShaderSource::Wgsl(kernel.source.into()) });
        let pipeline = device.create_compute_pipeline(&ComputePipelineDescriptor {
            label,
            layout: Some(&pipeline_layout),
            module: &shader,
            entry_point: Some(kernel.name),
            compilation_options: PipelineCompilationOptions::default(),
            cache: None,
        });
        Ok(Self { pipeline, workgroup_size: x, layout, variables })
    }

    /// Binds a buffer, or a part of one, to each variable of the kernel.
    ///
    /// # Panics
    /// A variable has no buffer.
    pub(super) fn bind(&self, device: &Device, buffers: &[(&str, &Buffer)], windows: &[(&str, Window)]) -> BindGroup {
        let entry = |variable: &Variable| {
            let window = windows.iter().find(|(name, _)| *name == variable.name);
            let whole = || buffers.iter().find(|(name, _)| *name == variable.name);
            let bound = match (window, whole) {
                (Some((_, Window { buffer, first, bytes })), _) => {
                    BufferBinding { buffer, offset: *first, size: BufferSize::new(*bytes) }
                }
                (None, whole) => {
                    let (_, buffer) = whole().unwrap_or_else(|| panic!("no buffer for `{}`", variable.name));
                    BufferBinding { buffer, offset: 0, size: variable.parameters.and_then(BufferSize::new) }
                }
            };
            BindGroupEntry { binding: variable.binding, resource: BindingResource::Buffer(bound) }
        };
        let entries: Vec<_> = self.variables.iter().map(entry).collect();
        device.create_bind_group(&BindGroupDescriptor { label: None, layout: &self.layout, entries: &entries })
    }
}

impl Variable {
    fn layout(&self) -> BindGroupLayoutEntry {
        let ty = match self.parameters {
            Some(_) => BufferBindingType::Uniform,
            None => BufferBindingType::Storage { read_only: self.read_only },
        };
        let min_binding_size = self.parameters.and_then(BufferSize::new);
        BindGroupLayoutEntry {
            binding: self.binding,
            visibility: ShaderStages::COMPUTE,
            ty: BindingType::Buffer { ty, has_dynamic_offset: self.parameters.is_some(), min_binding_size },
            count: None,
        }
    }
}

fn variables(module: &Module) -> Vec<Variable> {
    let variable = |variable: &naga::GlobalVariable| {
        let size = u64::from(module.types[variable.ty].inner.size(module.to_ctx()));
        let (parameters, read_only) = match variable.space {
            AddressSpace::Uniform => (Some(size), true),
            AddressSpace::Storage { access } => (None, !access.contains(StorageAccess::STORE)),
            _ => return None,
        };
        let binding = variable.binding?.binding;
        Some(Variable { name: variable.name.clone()?, binding, parameters, read_only })
    };
    module.global_variables.iter().filter_map(|(_, global)| variable(global)).collect()
}
